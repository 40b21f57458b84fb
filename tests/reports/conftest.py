"""Fixtures of the tests of pages."""

from ..builders.browser import chromium

__all__ = ["chromium"]
