"""The loop that runs a machine on a robot, one tick after the other."""
