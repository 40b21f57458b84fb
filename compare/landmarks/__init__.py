"""Maps of landmarks: their difference from a reference map, and landmarks that are not static."""
