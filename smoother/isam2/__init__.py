"""iSAM2 over the whole graph: the reference estimator `isam2` and its by-product `isam2-online`."""
