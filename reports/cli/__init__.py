"""The command `fgbaseline`. Nothing heavy is imported before a command that needs it runs."""

from .main import main

__all__ = ["main"]
