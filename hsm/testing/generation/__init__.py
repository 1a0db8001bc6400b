"""Tests generated from an exploration: what is left to reach, and steps that distinguish a machine from its mutants."""
