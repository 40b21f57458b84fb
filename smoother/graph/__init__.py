"""The problem as a GTSAM factor graph: keys, factors, conversions, covariances and Gauss-Newton steps."""
