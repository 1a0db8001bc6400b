"""The examples in the pages about the link work."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
import typer.main

from maze_machine.catalogue.profile import load_profile
from maze_machine.cli import app
from transport.security import Access, read_access

DOCS = Path(__file__).parents[2] / "docs"
ROS2 = DOCS / "how-to" / "ros2.md"
PAGES = [DOCS / "reference" / "link.md", DOCS / "explanation" / "link.md", ROS2, DOCS / "explanation" / "sensors.md"]
TEXT = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)


@pytest.mark.parametrize("block", blocks("python"))
def test_the_python_examples_run(block: str) -> None:
    exec(compile(block, "docs", "exec"), {})


@pytest.mark.parametrize("line", [line for block in blocks("console") for line in block.splitlines() if line])
def test_the_commands_are_understood(line: str) -> None:
    name, subcommand, *arguments = shlex.split(line)
    assert name == "maze-machine"
    command = typer.main.get_command(app).commands[subcommand]
    command.make_context(subcommand, arguments)


def test_the_access_file_is_one(tmp_path: Path) -> None:
    (tmp_path / "access.toml").write_text(blocks("toml")[0])
    assert read_access(tmp_path / "access.toml") == Access(
        robots=["pico1", "pico2"],
        controllers={"alice": ["pico1"], "bob": ["pico1", "pico2"]},
        watchers={"eve": ["pico1"]},
        operators={"olga": ["pico1"]},
    )


def test_the_profile_of_a_ros_2_robot_is_one(tmp_path: Path) -> None:
    (text,) = re.findall(r"```toml title=\"burger.toml\"\n(.*?)```", ROS2.read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "burger.toml").write_text(text)
    profile = load_profile(str(tmp_path / "burger.toml"))
    assert (profile.robot.topics_below, profile.link.command_type) == ("", "TwistStamped")
    assert profile.robot.laser.geometry().all_round


@pytest.mark.parametrize("setting", re.findall(r"`link\.(\w+)", TEXT))
def test_the_settings_exist(setting: str) -> None:
    from transport.messages import LinkStatus  # noqa: PLC0415
    from transport.settings import LinkSettings  # noqa: PLC0415

    assert setting in LinkSettings.model_fields or setting in LinkStatus.__dataclass_fields__
