"""Tests generated from an exploration: goals, and steps that distinguish a machine from its mutants."""
