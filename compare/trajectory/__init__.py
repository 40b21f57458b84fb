"""Two trajectories: association in time, alignment, ATE and RPE, KITTI segments, drift, divergence along the path."""
