"""Problems: their definition, the `documented` preset, and the noise over gaps between frames."""

from .definition import Excluded, LandmarkMode, LandmarkPrior, NoiseSettings, Problem

__all__ = ["Excluded", "LandmarkMode", "LandmarkPrior", "NoiseSettings", "Problem"]
