"""Scenarios and properties in test files: reading, running and writing them."""
