"""A robot that is not there: mazes, laser, physics, doors, noise and the referee."""
