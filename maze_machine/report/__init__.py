"""What a run shows and writes: progress, results, pictures and test reports."""
