"""Initial state, depths and pixel noise of a recording with one camera, from tracks and inertial samples."""
