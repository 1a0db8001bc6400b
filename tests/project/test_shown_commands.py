"""Every command line that a page or an example shows names a command with arguments and options that it has."""

import re
import shlex
from pathlib import Path

import pytest
import typer.main

from maze_machine.cli import app

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md")]
PAGES += sorted((ROOT / "docs").rglob("*.md"))
FENCED = re.compile(r"^ *```(?:sh|console|yaml|bash)[^\n]*\n(.*?)^ *```$", re.DOTALL | re.MULTILINE)
ANY_FENCED = re.compile(r"^ *```.*?^ *```$", re.DOTALL | re.MULTILINE)
INLINE = re.compile(r"`(maze-machine [^`]+)`")
COMMANDS = typer.main.get_command(app).commands
ENDS = (";", "|", "||", "&", "&&", "<", ">", ">>", "(", ")")
ABRIDGED = ("MissingParameter", "BadOptionUsage", "NoArgsIsHelpError")
"""Errors of commands of which running text leaves out a part."""


def shown(page):
    """The commands of a page, each as its words without ``maze-machine``."""
    text = page.read_text(encoding="utf-8")
    lines = [line for block in FENCED.findall(text) for line in block.replace("\\\n", " ").splitlines()]
    for line in lines:
        yield from commands_in(line)
    for span in INLINE.findall(ANY_FENCED.sub("", text)):
        yield from commands_in(" ".join(span.split()))


def commands_in(line):
    lexer = shlex.shlex(line, posix=True, punctuation_chars=True)
    lexer.whitespace_split = True
    try:
        words = list(lexer)
    except ValueError:  # output of a command, with an apostrophe
        return
    for at, word in enumerate(words):
        before = words[at - 1] if at else "$"
        if re.fullmatch(r"(\S*/)?maze-machine", word) and (before in ENDS or before in ("$", "then", "run:")):
            end = next((here for here in range(at, len(words)) if words[here] in ENDS), len(words))
            if end > at + 1:
                yield words[at + 1 : end]


FOUND = {" ".join(words): words for page in PAGES for words in shown(page)}


@pytest.mark.parametrize("words", FOUND.values(), ids=list(FOUND))
def test_a_shown_command_is_understood(words):
    assert problem(words) in ("", *(ABRIDGED if len(words) <= 3 else ()))


def problem(words):
    """What is wrong with a command; empty for nothing."""
    name, *arguments = words
    if name in ("COMMAND", "--version", "--help"):
        return ""
    try:
        COMMANDS[name].make_context(name, arguments)
    except typer.Exit:  # --help
        return ""
    except (typer.BadParameter.__mro__[1], KeyError) as error:
        return type(error).__name__
    return ""


def test_the_pages_show_commands():
    assert len(FOUND) > 150
    assert {words[0] for words in FOUND.values()} >= {"check", "test", "run", "sim", "watch", "sweep", "fmt", "lsp"}


@pytest.mark.parametrize(
    ("line", "wrong"),
    [
        ("$ maze-machine run pledge --sped 3   # slowly", "NoSuchOption"),
        ("x=1 && .venv/bin/maze-machine rum pledge", "KeyError"),
        ("maze-machine sim --view", "NoSuchOption"),
        ("maze-machine run pledge a b c | head", "UsageError"),
    ],
)
def test_a_command_that_does_not_exist_is_found(line, wrong):
    (words,) = commands_in(line)
    assert problem(words) == wrong
