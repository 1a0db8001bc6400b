"""Campaigns: many runs, the workers that do them, and their summary."""
