"""Findings in sentences, and the diagnosis as JSON."""
