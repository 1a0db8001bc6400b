"""Mutation of machines, to measure their tests."""
