"""What is wrong with a recording, found from the recording alone, and its repair."""

from .bridge import blind_intervals, bridged
from .diagnosis import Diagnosis
from .findings import findings_of, not_identifiable, rescalings
from .repair import Repaired, repair
from .report import to_json
from .stages import diagnose, known_units
from .tracks import Tracks, track_state
from .units import Units, unit_findings
from .unusable import unusable
from .wording import Finding

__all__ = [
    "Diagnosis",
    "Finding",
    "Repaired",
    "Tracks",
    "Units",
    "blind_intervals",
    "bridged",
    "diagnose",
    "findings_of",
    "known_units",
    "not_identifiable",
    "repair",
    "rescalings",
    "to_json",
    "track_state",
    "unit_findings",
    "unusable",
]
