"""Recordings in files, their observations, landmarks and ground truth."""
