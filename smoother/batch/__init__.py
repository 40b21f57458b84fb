"""Levenberg-Marquardt over the full graph: the estimator `batch`."""
