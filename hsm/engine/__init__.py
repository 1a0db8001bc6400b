"""The compiled machine and its runs: steps, coverage, explanations, snapshots and monitoring."""
