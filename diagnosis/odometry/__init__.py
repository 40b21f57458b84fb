"""Stereo visual odometry from frame to frame."""
