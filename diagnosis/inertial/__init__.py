"""Diagnosis of recordings with raw inertial samples, and the calibrated problem that they support."""
