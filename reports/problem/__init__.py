"""The problem that a recording poses by the settings of a run: default estimators, settings, tracks of images."""
