"""From facts to motion: motion skills, one at a time, and maze-solving strategies."""
