"""The process that runs a machine on a robot."""
