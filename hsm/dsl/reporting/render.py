"""Diagnostics for people and for programs: as text with the source line underlined, as JSON, as SARIF."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from hsm.model.codes import CODES
from hsm.model.diagnostics import Diagnostic, Place, Severity

_COLOURS = {Severity.ERROR: "31", Severity.WARNING: "33", Severity.NOTE: "36"}
_LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTE: "note"}
_WIDEST = 160


def as_text(findings: Sequence[Diagnostic], sources: Mapping[str, str], *, colour: bool = False) -> str:
    """Diagnostics as a person reads them, one paragraph each.

    Args:
        findings: what was found.
        sources: the text of each file, by the name that places have.
        colour: with the escape codes of a terminal.
    """
    lines = {file: text.replace("\r\n", "\n").split("\n") for file, text in sources.items()}
    return "\n\n".join("\n".join(_paragraph(found, lines, _Paint(colour))) for found in findings)


def summary(findings: Sequence[Diagnostic]) -> str:
    """How many errors, warnings and notes there are; empty where there is none."""
    counts = ((level, sum(found.severity is level for found in findings)) for level in reversed(Severity))
    return ", ".join(f"{count} {_LEVELS[level]}{'s' * (count != 1)}" for level, count in counts if count)


def as_json(findings: Sequence[Diagnostic]) -> str:
    """Diagnostics as a JSON document: ``{"version": 1, "findings": [...]}``; lines and columns count from 1."""
    return json.dumps({"version": 1, "findings": list(map(_record, findings))}, indent=2, ensure_ascii=False)


def as_sarif(findings: Sequence[Diagnostic], version: str) -> str:
    """Diagnostics in the Static Analysis Results Interchange Format 2.1.0.

    Args:
        findings: what was found.
        version: of this program.
    """
    names = list(CODES)
    rules = [
        {
            "id": code.name,
            "shortDescription": {"text": code.title},
            "defaultConfiguration": {"level": _LEVELS[code.severity]},
        }
        for code in CODES.values()
    ]
    results: list[dict[str, Any]] = []
    for found in findings:
        hint = f" ({found.suggestion})" if found.suggestion else ""
        result: dict[str, Any] = {
            "ruleId": found.code,
            "ruleIndex": names.index(found.code),
            "level": _LEVELS[found.severity],
            "message": {"text": found.message + hint},
            "locations": [_location(found.place)] if found.place is not None else [],
        }
        if found.related:
            result["relatedLocations"] = [
                {**_location(one.place), "id": number, "message": {"text": one.message}}
                for number, one in enumerate(found.related, 1)
            ]
        results.append(result)
    driver = {"name": "maze-machine", "version": version, "rules": rules}
    document = {
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{"tool": {"driver": driver}, "columnKind": "unicodeCodePoints", "results": results}],
    }
    return json.dumps(document, indent=2, ensure_ascii=False)


class _Paint:
    """Colours text, or leaves it plain."""

    def __init__(self, colour: bool) -> None:  # noqa: FBT001
        self.colour = colour

    def __call__(self, text: str, code: str) -> str:
        return f"\x1b[{code}m{text}\x1b[0m" if self.colour and text else text


def _paragraph(found: Diagnostic, lines: Mapping[str, list[str]], paint: _Paint) -> Iterator[str]:
    hue = _COLOURS[found.severity]
    head = paint(f"{found.severity.name.lower()}[{found.code}]", f"1;{hue}")
    yield f"{head}: {paint(_printable(found.message), '1')}"
    places = [one.place for one in found.related] + ([found.place] if found.place is not None else [])
    margin = " " * max((len(str(place.line)) for place in places), default=1)
    if found.place is not None:
        yield f"{margin}{paint('-->', '34')} {_printable(str(found.place))}"
        yield from _excerpt(found.place, lines, paint, margin, hue=hue, mark="^")
    for one in found.related:
        yield f"{margin}{paint('-->', '34')} {_printable(str(one.place))}: {one.message}"
        yield from _excerpt(one.place, lines, paint, margin, hue="34", mark="-")
    if found.suggestion:
        yield f"{margin} {paint('=', '34')} {paint('help', '1')}: {_printable(found.suggestion)}"


def _excerpt(
    place: Place, lines: Mapping[str, list[str]], paint: _Paint, margin: str, *, hue: str, mark: str
) -> Iterator[str]:
    """The source line of a place with the place underlined; for a very long line, the part around the place."""
    text = lines.get(place.file, [])
    if not 0 < place.line <= len(text):
        return
    line = _printable(text[place.line - 1].replace("\t", "    ").rstrip())
    start = place.column - 1
    end = place.end_column - 1 if place.end_line == place.line else len(line)
    if len(line) > _WIDEST:
        left = max(0, start - _WIDEST // 2)
        line, start, end = line[left : left + _WIDEST], start - left, min(end - left, _WIDEST)
    bar = paint("|", "34")
    yield f"{margin} {bar}"
    yield f"{paint(f'{place.line:>{len(margin)}}', '34')} {bar} {line}"
    yield f"{margin} {bar} {' ' * start}{paint(mark * max(1, end - start), f'1;{hue}')}"


def _printable(text: str) -> str:
    """Text without control characters for a terminal."""
    return "".join(one if one.isprintable() else "\N{REPLACEMENT CHARACTER}" for one in text)


def _record(found: Diagnostic) -> dict[str, Any]:
    record: dict[str, Any] = {
        "code": found.code,
        "severity": _LEVELS[found.severity],
        "title": CODES[found.code].title,
        "message": found.message,
        "place": _place(found.place),
        "suggestion": found.suggestion,
    }
    record["related"] = [{"message": one.message, "place": _place(one.place)} for one in found.related]
    return record


def _place(place: Place | None) -> dict[str, str | int] | None:
    if place is None:
        return None
    return {
        "file": place.file,
        "line": place.line,
        "column": place.column,
        "end_line": place.end_line,
        "end_column": place.end_column,
    }


def _location(place: Place) -> dict[str, Any]:
    path = Path(place.file)
    uri = path.as_uri() if path.is_absolute() else path.as_posix()
    region = {
        "startLine": place.line,
        "startColumn": place.column,
        "endLine": place.end_line,
        "endColumn": place.end_column,
    }
    return {"physicalLocation": {"artifactLocation": {"uri": uri}, "region": region}}
