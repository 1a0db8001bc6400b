"""What tests exercise, and its reports."""
