"""Reprojection and motion residuals: raw, whitened, by class; cost, noise scale, prediction of held-out tracks."""
