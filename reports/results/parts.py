"""Base of the models of JSON and TOML files, and parts that a run and a comparison share."""

import json
from functools import cached_property
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

Number = float | None
"""null for what is not a finite number; `notes` then says why"""
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Part(BaseModel):
    """An object of the file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Document(Part):
    """A whole file."""

    @cached_property
    def content(self) -> dict[str, Any]:
        """The file as nested dicts."""
        return self.model_dump(mode="json", by_alias=True)

    @classmethod
    def json_schema(cls) -> str:
        """JSON schema of the file, as text."""
        schema = cls.model_json_schema(by_alias=True, mode="serialization")
        return json.dumps({"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}, indent=2)


class Spread(Part):
    """Statistics of errors in m, over the frames that have one; null with the note `infinite` where one is infinite."""

    rmse: Number
    mean: Number
    median: Number
    p95: Number
    max: Number
    missing: Annotated[int, Field(description="NaN errors, which the values leave out")]


class Divergence(Spread):
    """Difference of poses, m and °, without alignment."""

    final: Number
    rotation_rmse_deg: Number
    rotation_final_deg: Number


class Reprojection(Spread):
    """Norm of the four pixel differences (uL, vL, uR, vR), px."""

    under_3px: Annotated[Number, Field(description="share, 0 to 1")]
    behind_camera: Annotated[int, Field(description="observations whose landmark lies behind the camera")]
    n: Annotated[int, Field(description="observations that the values are over")]


class PoseSigma(Part):
    """Sigma (3D, root of the trace) of the poses by the estimator's covariances, unaligned, first pose fixed."""

    position_rmse: Annotated[Number, Field(description="RMS along the trajectory, m")]
    position_final: Annotated[Number, Field(description="of the last pose that has a covariance, m")]
    rotation_rmse_deg: Annotated[Number, Field(description="RMS along the trajectory, degrees")]
    rotation_final_deg: Annotated[Number, Field(description="of the last pose that has a covariance, degrees")]


class Nees(Part):
    """Normalized estimation error squared of the poses, error log(T^-1 T_true) in the body frame."""

    mean: Annotated[Number, Field(description="6 is expected")]
    median: Annotated[Number, Field(description="5.35 is expected")]
    frames: int
