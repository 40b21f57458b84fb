"""One fault of a recording, as the reader or the diagnosis reports it."""

from dataclasses import dataclass

UNITS = frozenset({"time_unit", "angular_velocity_unit", "linear_velocity_unit", "baseline_unit"})
"""codes of values in other units than those of SI"""
OF_THE_FILE = frozenset(
    {
        "repeated_stamps",
        "stamps_rounded",
        "zero_for_unobserved",
        "extrinsic_inverse",
        *UNITS,
    }
)
"""codes of faults in how the file was written, which a run prints whatever its preset"""

AS_GIVEN = "as given"
"""the certainty of a finding that the user states"""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is wrong with a recording."""

    code: str
    """by which programs know it, such as `gyro_bias`"""
    sentence: str
    """for people, with figures"""
    before: float
    """a figure of the recording as it is, in `unit`"""
    after: float
    """the same once it is repaired and masked; equal to `before` where nothing can be put right"""
    unit: str
    certainty: str
    """how sure it is: a standard error, a lead in likelihood, or 'counted'"""
