"""Sentences and captions, a module for each kind of result."""
