"""Covariances against errors: NEES, ANEES over Monte-Carlo runs, NIS, and NEES of the difference from a reference."""
