"""Mutation of machines, to measure how much their tests notice."""
