"""Conditions as formulas: whether they can hold together, exact for linear arithmetic."""
