"""Problems: their definition, the `documented` preset, and the noise over gaps between frames."""

from .definition import (
    WRONG_MATCH,
    Excluded,
    InverseDepthPrior,
    LandmarkMode,
    LandmarkPrior,
    NoiseSettings,
    Problem,
)

__all__ = [
    "WRONG_MATCH",
    "Excluded",
    "InverseDepthPrior",
    "LandmarkMode",
    "LandmarkPrior",
    "NoiseSettings",
    "Problem",
]
