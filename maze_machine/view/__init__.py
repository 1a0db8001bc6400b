"""What a person looks at: the live page, plots, reports."""
