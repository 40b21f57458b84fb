"""Sentences on results, a module for each kind of result."""
