"""Tests generated from an exploration: what is left to reach, and steps that tell a machine from its mutants."""
