"""What all parts of `summary.json` have in common."""

from pydantic import BaseModel, ConfigDict

Number = float | None
"""null for what is not a finite number; `notes` then says why"""


class Part(BaseModel):
    """An object of the file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)
