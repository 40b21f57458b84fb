"""Initial state of raw inertial data, from stereo odometry and inertial samples by least squares."""
