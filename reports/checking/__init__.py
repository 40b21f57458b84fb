"""Accuracy limits for CI: what was measured against what was promised, and against how it was before."""
