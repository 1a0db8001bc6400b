"""Exploration of all that a machine can do: properties and generated tests."""
