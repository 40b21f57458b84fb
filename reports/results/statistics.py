"""Models that a run and a comparison share, and nested results (dicts of dicts, as JSON has them) by paths."""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

Number = float | None
"""null for what is not a finite number; `notes` then says why"""


class Part(BaseModel):
    """An object of the file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Spread(Part):
    """Statistics of errors in m, over the frames that have one; null with the note `infinite` where one is infinite."""

    rmse: Number
    mean: Number
    median: Number
    p95: Number
    max: Number
    missing: Annotated[int, Field(description="NaN errors, which the figures leave out")]


class Divergence(Spread):
    """Difference of poses, m and °, without alignment."""

    final: Number
    rotation_rmse_deg: Number
    rotation_final_deg: Number


class Reprojection(Spread):
    """Norm of the four pixel differences (uL, vL, uR, vR), px."""

    under_3px: Annotated[Number, Field(description="share, 0 to 1")]
    behind_camera: Annotated[int, Field(description="observations whose landmark lies behind the camera")]
    n: Annotated[int, Field(description="observations that the figures are over")]


class PoseSigma(Part):
    """1-sigma of the poses by the estimator's own covariances: the problem's noise, first pose fixed, unaligned."""

    position_rmse: Annotated[Number, Field(description="RMS along the path, m")]
    position_final: Annotated[Number, Field(description="of the last pose that has a covariance, m")]
    rotation_rmse_deg: Annotated[Number, Field(description="RMS along the path, degrees")]
    rotation_final_deg: Annotated[Number, Field(description="of the last pose that has a covariance, degrees")]


class Nees(Part):
    """Normalized estimation error squared of the poses, error log(T^-1 T_true) in the body frame."""

    mean: Annotated[Number, Field(description="6 is expected")]
    median: Annotated[Number, Field(description="5.35 is expected")]
    frames: int


INFINITE = "infinite"
"""the note of a value that is infinite, which JSON has as null"""


def at(tree: Any, *path: str) -> Any:
    """The value at a path of keys; None where a key on the way is missing."""
    for key in path:
        tree = tree.get(key) if isinstance(tree, Mapping) else None
    return tree


def leaves(tree: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """The path (keys joined by dots) and the value of everything that is not itself a mapping."""
    if isinstance(tree, Mapping):
        for key, inner in tree.items():
            yield from leaves(inner, f"{path}.{key}" if path else str(key))
    else:
        yield path, tree


def finite(tree: Any) -> Any:
    """The tree with None for every float that is not finite; keys are text, tuples are lists."""
    if isinstance(tree, Mapping):
        return {str(key): finite(inner) for key, inner in tree.items()}
    if isinstance(tree, list | tuple):
        return [finite(inner) for inner in tree]
    return None if isinstance(tree, float) and not math.isfinite(tree) else tree


def nulls(tree: Any) -> Iterator[tuple[str, bool]]:
    """The path of every value that is None or not finite, and whether it is infinite."""
    for path, value in leaves(tree):
        if value is None or (isinstance(value, float) and not math.isfinite(value)):
            yield path, value is not None and math.isinf(value)
