"""The report as one HTML file that opens offline, and its verdict in words."""

from .rendering import render
from .verdict import verdict

__all__ = ["render", "verdict"]
