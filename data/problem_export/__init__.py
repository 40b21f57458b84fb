"""Export of problems as plain files, for filters in other languages; reading them back is exact."""

from .reading import read_problem
from .writing import write_problem

__all__ = ["read_problem", "write_problem"]
