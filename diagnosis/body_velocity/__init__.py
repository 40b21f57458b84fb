"""Faults and noise of body velocities: the pipeline of their diagnosis and its result."""
