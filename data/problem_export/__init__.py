"""Problems as plain files, for filters that are not written in Python: written here, read back, the same to the bit."""

from .reading import read_problem
from .writing import write_problem

__all__ = ["read_problem", "write_problem"]
