"""Coverage: the data, and its reports."""
