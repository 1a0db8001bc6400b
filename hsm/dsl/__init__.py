"""The .maze-machine language: from text to a checked model."""
