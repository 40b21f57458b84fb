"""Noise and calibration errors estimated from windows."""
