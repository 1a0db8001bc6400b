"""The .maze-machine language: from text to a checked model."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hsm.dsl.loading import Checked, check_file, check_text, load_model, parse_model

__all__ = ["Checked", "check_file", "check_text", "load_model", "parse_model"]


def __getattr__(name: str) -> Any:
    """What is in ``__all__``, when it is asked for: who formats a text needs no checks."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module("hsm.dsl.loading"), name)
