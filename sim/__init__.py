"""A robot that is not there: maze files, laser, physics, doors, noise, odometry and the referee."""
