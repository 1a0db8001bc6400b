"""Conditions as formulas: can they hold together? Exact for linear arithmetic."""
