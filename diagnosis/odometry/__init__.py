"""Visual odometry from frame to frame: of a stereo pair, and of one camera up to scale."""
