"""Units, axes and delay of the recorded velocities."""
