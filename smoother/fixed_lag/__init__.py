"""The incremental fixed-lag smoother `fixed-lag`."""
