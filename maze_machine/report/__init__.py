"""What a run shows and leaves behind: progress, results, pictures and test reports."""
