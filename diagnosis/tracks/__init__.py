"""Track segments, and which observations of a track are consistent."""
