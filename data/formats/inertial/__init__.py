"""Raw inertial samples, their noise and their ground truth in files; body velocities."""
