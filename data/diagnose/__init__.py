"""What is wrong with a recording, found from the recording alone, and its repair."""

from .diagnosis import Diagnosis, diagnose
from .repair import Repaired, repair

__all__ = ["Diagnosis", "Repaired", "diagnose", "repair"]
