"""The interface to a robot: its messages, its description and its connections."""
