"""What a person names: machines, libraries and robot profiles, found by name or by file."""
