"""EKF-SLAM with one joint state: pose, optional gyroscope bias and landmarks, with all cross-covariances."""
