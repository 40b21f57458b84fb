"""What the cameras of a simulated drive see: landmarks of a street or a room, and moving objects."""
