"""Metrics of trajectories against a reference: data and computations, without files, text and drawing."""
