"""One table model, one writer of it for each form of output, and the tables of each kind of result."""
