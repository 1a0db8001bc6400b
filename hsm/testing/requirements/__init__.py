"""Requirements: which properties and scenarios cover them, in which states."""
