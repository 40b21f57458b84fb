"""Diagnosis of recordings: findings, repaired recordings, and the `calibrated` problem that they support."""

from fgbaseline.data.problem import NoiseSettings

from .body_velocity.pipeline import diagnose, known_units
from .body_velocity.result import Diagnosis
from .calibrated import AsRecordedSettings, calibrated
from .conventions.units import Units, unit_findings
from .findings.json_report import to_json
from .findings.track_statistics import TrackStatistics, track_statistics
from .findings.velocity_findings import findings_of, not_identifiable
from .inertial.findings import inertial_findings
from .inertial.json_report import inertial_sentences, inertial_to_json
from .inertial.pipeline import diagnose_inertial
from .inertial.result import InertialDiagnosis
from .repair_overrides.settings import Repairs, read_repairs
from .repair_overrides.template import repairs_text
from .repairs.repaired_sequence import Repaired, repair
from .track_holdout import hold_out
from .tracks.recording_faults import unusable

__all__ = [
    "AsRecordedSettings",
    "Diagnosis",
    "InertialDiagnosis",
    "NoiseSettings",
    "Repaired",
    "Repairs",
    "TrackStatistics",
    "Units",
    "calibrated",
    "diagnose",
    "diagnose_inertial",
    "findings_of",
    "hold_out",
    "inertial_findings",
    "inertial_sentences",
    "inertial_to_json",
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
