"""A run, its figures, its page and the command line."""
