"""Values of a command line that need no conversion: a text for a text, a default for anything.

Typer converts all values with pydantic, whose import takes longer than a small command does. Whatever is of its
parameter's type already stays as it is, and so does what is left out; the first other value brings pydantic in. This
leans on a private part of typer: where a parameter has none of that name, nothing is changed and typer converts all.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from enum import EnumMeta
from typing import Any, get_args, get_origin

import typer

_PRIVATE = "_runtime_param"


def spare_conversions(parameters: Iterable[Any]) -> None:
    """Keep values that have their parameter's type from being converted.

    Args:
        parameters: those of a command, as typer has them.
    """
    for parameter in parameters:
        if getattr(parameter, _PRIVATE, ...) is None:
            setattr(parameter, _PRIVATE, _AsItIs(parameter.type_descriptor.annotation))


def _in_our_words(error: typer.BadParameter) -> typer.BadParameter:
    """The same error; what pydantic says about a value in the words of this project's other messages."""
    errors = getattr(error.__cause__, "errors", None)
    if errors is None:
        return error
    from transport.wording import in_words  # noqa: PLC0415 - pydantic is imported here already

    (found, *_) = errors()
    found["loc"] = ()
    return typer.BadParameter(in_words(found), ctx=error.ctx, param=getattr(error, "param", None))


@dataclass(frozen=True, slots=True)
class _AsItIs:
    """What typer converts one parameter's values with.

    Attributes:
        annotation: the type that the parameter has.
    """

    annotation: Any

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        """The value as it is, or as typer converts it."""
        if value is None:
            return () if param.multiple or param.nargs == -1 else None
        if self._is_of_type(value):
            return value
        if isinstance(self.annotation, EnumMeta):
            with suppress(ValueError):
                return self.annotation(value)
        setattr(param, _PRIVATE, None)
        conversion = param.get_runtime_param()
        setattr(param, _PRIVATE, self)
        try:
            return conversion.coerce(value, param=param, ctx=ctx)
        except typer.BadParameter as error:
            raise _in_our_words(error) from error.__cause__

    def _is_of_type(self, value: Any) -> bool:
        if get_origin(self.annotation) is list:
            texts = get_args(self.annotation) == (str,)
            return texts and isinstance(value, list | tuple) and all(isinstance(one, str) for one in value)
        return type(value) is self.annotation
