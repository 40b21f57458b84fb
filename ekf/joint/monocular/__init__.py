"""What one camera adds to the joint filter: inverse depths that are not known yet."""
