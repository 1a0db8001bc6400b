"""The command line as a whole: help, unknown names, what it imports before it is told to."""

import subprocess
import sys

import pytest
import typer.main
from typer.testing import CliRunner

from maze_machine.cli import app
from maze_machine.command_table import PLACES


def commands(group=None, prefix=()):
    group = group or typer.main.get_command(app)
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, (*prefix, name))
        else:
            yield (*prefix, name), command


@pytest.mark.parametrize(
    ("path", "command"), list(commands()), ids=lambda value: " ".join(value) if isinstance(value, tuple) else ""
)
def test_every_command_has_help_with_an_example(path, command):
    shown = CliRunner().invoke(app, [*path, "--help"], env={"COLUMNS": "200"})
    assert shown.exit_code == 0
    assert f"maze-machine {' '.join(path)}" in command.help, "the docstring gives an example"
    undocumented = [one.name for one in command.params if not one.help]
    assert undocumented == []


def test_help_needs_none_of_the_heavy_packages():
    heavy = "numpy", "zenoh", "pymunk", "matplotlib", "lark", "pydantic", "rosbags", "transitions"
    code = f"import sys, maze_machine.cli; print([name for name in {heavy} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_the_list_of_commands_imports_no_command_and_no_rich():
    code = (
        "import sys; from maze_machine.cli import app; app(['--help'], standalone_mode=False)\n"
        "print([one for one in sys.modules if one.startswith(('maze_machine.commands', 'rich'))], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr == "[]\n"
    assert all(f"  {name}  " in done.stdout for name in PLACES)


@pytest.mark.parametrize("one", PLACES.values(), ids=lambda one: one.name)
def test_the_summary_in_the_list_is_the_first_sentence_of_the_help_text(one):
    command = typer.main.get_command(app).commands[one.name]
    assert command.name == one.name
    assert one.summary == " ".join(command.help.split("\n\n")[0].split())


@pytest.mark.parametrize("arguments", [["no-such-command"], ["run"], ["run", "--no-such-option"]])
def test_wrong_usage_ends_with_status_2(arguments):
    ended = CliRunner().invoke(app, arguments)
    assert ended.exit_code == 2
    assert "Usage" in ended.stderr
    assert "Traceback" not in ended.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["list", "sensors"], "'sensors' is not one of 'machines', 'mazes'"),
        (["run", "pledge", "--seed", "x"], "must be a whole number, not 'x'"),
        (["run", "pledge", "--time-limit", "soon"], "must be a number, not 'soon'"),
        (["run", "pledge", "--attempts", "0"], "must be at least 1, not '0'"),
    ],
)
def test_a_wrong_value_is_named_in_our_words_each_time(arguments, message):
    for _ in range(2):
        shown = " ".join(CliRunner().invoke(app, arguments).stderr.replace("│", " ").split())
        assert message in shown
        assert "Value error" not in shown


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("maze-machine re", {"replay"}),
        ("maze-machine run ple", {"pledge", "pledge_smooth"}),
        ("maze-machine run pledge --maze fin", {"final_2015"}),
        ("maze-machine run pledge --robot pico-", {"pico-hardware"}),
    ],
)
def test_a_shell_completes_commands_and_shipped_names(words, offered):
    environment = {"_MAZE_MACHINE_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
    shown = CliRunner().invoke(app, prog_name="maze-machine", env=environment).stdout
    assert set(shown.split()) == offered


@pytest.mark.parametrize(("one", "all_of_them"), [("signal", "signals"), ("activity", "activities"), ("maze", "mazes")])
def test_one_name_stands_for_all_in_a_list(one, all_of_them):
    listed = CliRunner().invoke(app, ["list", one])
    assert listed.exit_code == 0
    assert listed.stdout == CliRunner().invoke(app, ["list", all_of_them]).stdout
    assert len(listed.stdout.splitlines()) > 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give one of them; a recording, or --connect"),
        (["run.mcap", "--connect", "tcp/127.0.0.1:7448"], "give one of them; a recording, or --connect"),
        (["--connect", "tcp/127.0.0.1:7448", "-o", "page.html"], "-o and --foxglove need a recording"),
    ],
)
def test_a_view_is_of_a_recording_or_of_a_running_machine(arguments, message):
    ended = CliRunner().invoke(app, ["view", *arguments])
    assert ended.exit_code == 2
    assert message in ended.stderr
