"""A simulated robot: maze files, laser, physics, doors, noise, odometry and the referee."""
