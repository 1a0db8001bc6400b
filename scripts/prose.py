"""Report phrases that `scripts/prose.toml` lists, in pages, docstrings, comments, messages and machines.

    python scripts/prose.py [--count] [FILE ...]

Code is not prose: in Markdown, fenced blocks and `code` are left out; in Python, everything except comments and texts.
"""

from __future__ import annotations

import io
import re
import subprocess
import sys
import tokenize
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = (
    "hsm",
    "skills",
    "perception",
    "machines",
    "transport",
    "sim",
    "maze_machine",
    "docs",
    "examples",
    "benchmarks",
)
KINDS = ("py", "md", "maze-machine", "maze-test", "toml", "html", "js", "sh", "yml", "lark")
CODE = re.compile(
    r"``.+?``|`[^`\n]+`|:\w+:`[^`]+`|\]\([^)]*\)|https?://\S+|\{[^{}]*\}|^ +[a-z_]+:(?= )|--[a-z-]+",
    re.DOTALL | re.MULTILINE,
)
FENCE = re.compile(r"^( *)```.*?^\1```$", re.DOTALL | re.MULTILINE)
TEXTS = {tokenize.STRING, tokenize.COMMENT, getattr(tokenize, "FSTRING_MIDDLE", -1)}
SCRIPT = re.compile(r"<(script|style)\b.*?</\1>", re.DOTALL)
COMMENT = re.compile(r"(?<!\S)#[^\n]*|(?<!:)//[^\n]*|/\*.*?\*/|<!--.*?-->", re.DOTALL)
SHOWN = re.compile(rf"{COMMENT.pattern}|>[^<>{{}}]+<", re.DOTALL)


@dataclass(frozen=True)
class Rule:
    """A phrase to avoid, and what to write instead."""

    pattern: re.Pattern[str]
    instead: str


def rules() -> list[Rule]:
    """All rules of the list, in its order."""
    listed = tomllib.loads((ROOT / "scripts" / "prose.toml").read_text(encoding="utf-8"))
    return [
        Rule(re.compile(pattern.replace(" ", r"\s+"), re.IGNORECASE), instead)
        for section in listed.values()
        for pattern, instead in section.items()
    ]


def kind_of(path: Path) -> str:
    """The suffix of a file; of a template, that of the file that it becomes."""
    return path.name.removesuffix(".in").rpartition(".")[2]


def prose(path: Path) -> Iterator[tuple[int, str]]:
    """The passages of a file that people read, each with the number of its first line."""
    text, kind = path.read_text(encoding="utf-8"), kind_of(path)
    if kind == "py":
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type in TEXTS and " " in token.string:  # a single word is a key or a name
                yield token.start[0], token.string
    elif kind == "md":
        yield 1, FENCE.sub(lambda fence: "\n" * fence[0].count("\n"), text)
    else:
        listed = SHOWN if kind == "html" else COMMENT
        text = SCRIPT.sub(lambda script: "\n" * script[0].count("\n"), text)
        yield from ((text.count("\n", 0, one.start()) + 1, one[0]) for one in listed.finditer(text))


def problems(path: Path, listed: list[Rule]) -> Iterator[tuple[int, str, Rule]]:
    """What the rules find in a file: line, phrase, rule."""
    for line, passage in prose(path):
        plain = CODE.sub(lambda code: "\n" * code[0].count("\n"), passage)
        for rule in listed:
            for found in rule.pattern.finditer(plain):
                yield line + plain.count("\n", 0, found.start()), " ".join(found[0].split()), rule


def tracked() -> list[Path]:
    """The files under version control that the rules are for."""
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    paths = (path for name in names.split("\0") if kind_of(path := ROOT / name) in KINDS)
    inside = (path for path in paths if path.parent == ROOT or path.relative_to(ROOT).parts[0] in (*FOLDERS, "scripts"))
    return [path for path in inside if path.is_file() and path.name != "prose.toml"]


def main(arguments: list[str]) -> int:
    """Print what is found; the exit status is 1 if there is anything."""
    count, names = "--count" in arguments, [one for one in arguments if not one.startswith("--")]
    listed, total = rules(), Counter[str]()
    for path in map(Path, names) if names else tracked():
        for line, phrase, rule in problems(path, listed):
            total[rule.pattern.pattern] += 1
            if not count:
                print(f"{path}:{line}: {phrase!r}: write: {rule.instead}")
    if count:
        for pattern, times in total.most_common():
            print(f"{times:6} {pattern}")
        print(f"{total.total():6} in all")
    return 1 if total else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
