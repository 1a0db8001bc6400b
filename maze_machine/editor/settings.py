"""Settings of an editor for the language server, and their precedence.

From the strongest to the weakest: the command line (``--library``), the project file of a document, the editor's
configuration (``workspace/configuration``, section ``maze-machine``), the options that it starts the server with
(``initializationOptions``). Only ``ignore`` accumulates.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

SECTION = "maze-machine"
"""The section of the editor's configuration."""


@dataclass(frozen=True, slots=True)
class EditorSettings:
    """The settings of an editor.

    Attributes:
        library: the library of files whose project names none, as ``MODULE:NAME``; None for the shipped one.
        ignore: prefixes of the codes of warnings and notes that are not shown.
        hints: whether defaults of arguments are shown beside calls.
        coverage: whether the coverage of each state by its tests is shown above it.
        trusted: whether the user lets the code of the folder run; None if the editor does not say.
        requires: the oldest version of this program that the editor's extension works with; empty for any.
    """

    library: str | None = None
    ignore: tuple[str, ...] = ()
    hints: bool = True
    coverage: bool = True
    trusted: bool | None = None
    requires: str = ""


def read_settings(options: object, configuration: object) -> EditorSettings:
    """The settings in what an editor has sent; what is not of its type is skipped.

    Args:
        options: its ``initializationOptions``.
        configuration: its answer to ``workspace/configuration``, or None.
    """
    started = options if isinstance(options, Mapping) else {}
    set_now = configuration if isinstance(configuration, Mapping) else {}
    both: dict[str, Any] = {**started, **{name: value for name, value in set_now.items() if value is not None}}
    listed = [*_texts(started.get("ignore")), *_texts(set_now.get("ignore"))]
    return EditorSettings(
        library=_of_type(both.get("library"), str) or None,
        ignore=tuple(dict.fromkeys(listed)),
        hints=_of_type(both.get("inlayHints"), bool) is not False,
        coverage=_of_type(both.get("coverage"), bool) is not False,
        trusted=_of_type(started.get("trusted"), bool),  # only the program that starts the server can say so
        requires=_of_type(started.get("requires"), str) or "",
    )


def too_old(version: str, required: str) -> bool:
    """Whether a version is older than another, comparing only the leading numbers."""
    return bool(required) and _numbers(version) < _numbers(required)


def _numbers(version: str) -> tuple[int, ...]:
    found = re.match(r"\d+(?:\.\d+)*", version)
    return tuple(map(int, found.group().split("."))) if found else ()


def _of_type(value: object, kind: type) -> Any:
    return value if isinstance(value, kind) else None


def _texts(value: object) -> list[str]:
    return [one for one in value if isinstance(one, str)] if isinstance(value, list) else []
