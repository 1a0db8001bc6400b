"""TOML from files and from the command line, in bounded time and memory."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

LARGEST = 2**20
"""The largest file, bytes."""


class TomlError(ValueError):
    """A text that is not valid TOML, or a file that cannot be a settings file."""


class NoTomlError(TomlError):
    """A text that is not valid TOML."""


def read_toml(path: Path) -> dict[str, Any]:
    """The table in a file.

    Raises:
        TomlError: it is not TOML in UTF-8, or larger than a MiB.
        OSError: it cannot be read.
    """
    with path.open("rb") as file:  # not to the end: a device may have none
        content = file.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise TomlError("it is larger than 1 MiB, the limit for settings")
    try:
        return parse_toml(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise TomlError(f"byte {error.start + 1} is not UTF-8") from None


def parse_toml(text: str) -> dict[str, Any]:
    """The table in a text.

    Raises:
        TomlError: it is not TOML, or nested too deep.
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise NoTomlError(str(error)) from None
    except ValueError:
        raise TomlError("a number in it has too many digits") from None
    except RecursionError:
        raise TomlError("it is nested too deep") from None


def toml_value(text: str) -> Any:
    """The value that a text on the command line represents; a bare word is a string: a shell would eat its quotes.

    Raises:
        TomlError: it is nested too deep, or a number has too many digits.
    """
    try:
        return parse_toml(f"value = {text}")["value"]
    except NoTomlError:
        return text
