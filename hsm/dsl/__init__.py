"""The .maze-machine language: from text to a checked model."""

from hsm.dsl.loading import Checked, check_file, check_text, load_model, parse_model

__all__ = ["Checked", "check_file", "check_text", "load_model", "parse_model"]
