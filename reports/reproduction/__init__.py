"""Reproduction of the source paper of the documented filter: its figures, its claims, and causes of failure."""
