"""Diagnosis of recordings: findings, repaired recordings, and the `calibrated` problem that they support."""

from fgbaseline.data.problem import NoiseSettings

from .calibrated import Calibration, calibrated
from .conventions.units import Units, unit_findings
from .estimation.pipeline import diagnose, known_units
from .estimation.result import Diagnosis
from .findings.json_report import to_json
from .findings.track_statistics import TrackStatistics, track_statistics
from .findings.velocity_findings import findings_of, not_identifiable
from .held_out import hold_out
from .repair_overrides.settings import Repairs, read_repairs
from .repair_overrides.template import repairs_text
from .repairs.repaired_sequence import Repaired, repair
from .tracks.unusable import unusable

__all__ = [
    "Calibration",
    "Diagnosis",
    "NoiseSettings",
    "Repaired",
    "Repairs",
    "TrackStatistics",
    "Units",
    "calibrated",
    "diagnose",
    "findings_of",
    "hold_out",
    "known_units",
    "not_identifiable",
    "read_repairs",
    "repair",
    "repairs_text",
    "to_json",
    "track_statistics",
    "unit_findings",
    "unusable",
]
