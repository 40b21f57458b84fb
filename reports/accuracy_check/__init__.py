"""Accuracy check for CI: metrics against limits and against a baseline."""

from .assert_accuracy import assert_accuracy

__all__ = ["assert_accuracy"]
