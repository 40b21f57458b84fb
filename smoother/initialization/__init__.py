"""Initial values: landmarks by triangulation, poses by prediction, and paths by windowed optimization."""
