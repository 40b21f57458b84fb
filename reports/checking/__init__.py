"""Accuracy limits for CI: what was measured against what was promised, and against how it was before."""

from .accuracy import assert_accuracy

__all__ = ["assert_accuracy"]
