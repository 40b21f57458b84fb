"""Trajectories in files: TUM, EuRoC, KITTI, other CSV, npz, and topics of bags."""
