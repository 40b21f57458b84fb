"""Estimates, and the estimators that give them: registry, files of the user, and the runner."""
