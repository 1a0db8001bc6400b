"""From facts to motion."""
