"""Output of runs: progress, results, pictures and test reports."""
