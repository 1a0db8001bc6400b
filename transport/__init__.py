"""The robot as seen from outside: its messages, its description and the ways to reach it."""
