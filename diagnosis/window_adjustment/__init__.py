"""Bundle adjustment of short windows of frames."""
