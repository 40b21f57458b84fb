"""Estimation of faults and noise: the pipeline of a diagnosis and its result."""
