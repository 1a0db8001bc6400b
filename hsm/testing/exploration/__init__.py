"""Exploration of the state space of a machine: for properties and generated tests."""
