"""One fault of a recording, as the reader or the diagnosis reports it."""

from dataclasses import dataclass

UNITS = frozenset({"time_unit", "angular_velocity_unit", "linear_velocity_unit", "baseline_unit"})
"""codes of values in other units than those of SI"""
OF_THE_FILE = frozenset(
    {
        "repeated_stamps",
        "stamps_rounded",
        "zero_for_unobserved",
        "doubled_samples",
        "frames_without_samples",
        "extrinsic_inverse",
        *UNITS,
    }
)
"""codes of faults of the file itself, which a run prints with every preset"""

AS_GIVEN = "as given"
"""the certainty of a finding that the user states"""


@dataclass(frozen=True, slots=True)
class Finding:
    """A fault of a recording."""

    code: str
    """identifier for programs, such as `gyro_bias`"""
    sentence: str
    """description with figures"""
    before: float
    """a figure of the recording as it is, in `unit`"""
    after: float
    """the figure once repaired and masked; equal to `before` where nothing can be repaired"""
    unit: str
    certainty: str
    """a standard error, a lead in likelihood, or 'counted'"""
