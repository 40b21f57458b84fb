"""Reprojection and motion residuals: raw, whitened, by class, their cost, the noise scale they imply, held-out tracks."""
