"""The report that documents the filter, reproduced: its figures, its claims tested, and where its filter breaks."""
