"""What all parts of `summary.json` have in common."""

from pydantic import BaseModel, ConfigDict

Number = float | None
"""null for what is not a finite number; `notes` then says why"""
INFINITE = "infinite"
"""the note of a figure that is infinite"""


class Part(BaseModel):
    """An object of the file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)
