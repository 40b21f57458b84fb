"""A run: settings, the problem it poses, its solution and the folder that it writes."""
