"""The embedded simulator as the loop's robot."""
