"""What is wrong with a recording, found from the recording alone, and its repair."""

from .bridge import blind_intervals, bridged
from .diagnosis import Diagnosis, diagnose
from .findings import findings_of, not_identifiable
from .repair import Repaired, repair
from .report import to_json
from .tracks import Tracks, track_state
from .wording import Finding

__all__ = [
    "Diagnosis",
    "Finding",
    "Repaired",
    "Tracks",
    "blind_intervals",
    "bridged",
    "diagnose",
    "findings_of",
    "not_identifiable",
    "repair",
    "to_json",
    "track_state",
]
