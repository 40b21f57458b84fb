"""Time stamps in files: their units, and stamps of frames."""
