"""Readers and writers of recordings and trajectories."""

from .recording import read

__all__ = ["read"]
