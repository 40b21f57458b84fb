"""Figures for a paper, drawn again from the folder that a run left behind."""

from .drawing import draw
from .folder import Drawn, read_drawn
from .writing import FORMATS, write

__all__ = ["FORMATS", "Drawn", "draw", "read_drawn", "write"]
