"""Draw the animation of the README: the README's machine leaves a maze, and the state that is active is lit.

    python scripts/readme_animation.py

The machine and the maze are run in the simulator with seed 0. The pictures are SVG with CSS animations, one for light
pages and one for dark ones. A reader who asked for less motion sees the path and the first state.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import drive, prepare
from maze_machine.drive.tick import Tick
from maze_machine.simulated.world import SimulatedWorld, find_maze
from transport.description import RobotDescription
from transport.messages import Pose
from transport.world import LockstepRobot

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images"
MAZE = """name  spiral
start 1.5 1.5 0
wall 3 3  0 3  0 0  4 0  4 3
wall 3 3  3 1  1 1  1 2  2 2
exit 3 3  4 3
"""
WALLS = ((3, 3, 0, 3, 0, 0, 4, 0, 4, 3), (3, 3, 3, 1, 1, 1, 1, 2, 2, 2))
SCALE, MARGIN, WIDTH, HEIGHT = 64, 24, 460, 264
BOXES = {"driving": 44, "turning": 104, "outside": 172, "stuck": 222}
"""Where each state's box begins, px from the top."""

FASTER, EVERY = 5.0, 3
"""The animation runs this many times as fast as the robot; one frame for each EVERY ticks."""


@dataclass(frozen=True)
class Colours:
    """The colours of one variant."""

    text: str
    faint: str
    wall: str
    lit: str
    lit_text: str
    robot: str


VARIANTS = {
    "run-light.svg": Colours("#1f2328", "#afb8c1", "#1f2328", "#0a7d6c", "#ffffff", "#d1540f"),
    "run-dark.svg": Colours("#e6edf3", "#57606a", "#e6edf3", "#2dbfa8", "#06231f", "#ff9d5c"),
}


@dataclass(frozen=True)
class Frame:
    """One moment: the robot's true pose and the active state."""

    pose: Pose
    state: str


def main() -> None:
    """Run the machine and draw both variants."""
    frames = run()
    for name, colours in VARIANTS.items():
        (IMAGES / name).write_text(svg(frames, colours), encoding="utf-8")


def machine_text() -> str:
    """The machine that the README shows."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"^```maze-machine title=\"\S+\"\n(.*?)^```$", readme, re.DOTALL | re.MULTILINE)
    return str(text)


def run() -> Sequence[Frame]:
    """The frames of a run."""
    with tempfile.TemporaryDirectory() as folder:
        maze, machine = Path(folder) / "spiral.maze", Path(folder) / "spiral.maze-machine"
        maze.write_text(MAZE, encoding="utf-8")
        machine.write_text(machine_text(), encoding="utf-8")
        profile = load_profile()
        world = SimulatedWorld(find_maze(str(maze), robot=RobotDescription()), profile.robot, 0)
        robot, mission, frames = LockstepRobot(world), prepare(str(machine), profile), []

        def keep(tick: Tick) -> None:
            frames.append(Frame(world.pose(tick.index), tick.configuration[-1]))

        ending = drive(mission, robot, robot, [keep])
    frames.append(Frame(frames[-1].pose, ending.outcome or "outside"))
    return [*frames[:-1:EVERY], *[frames[-1]] * 8]


def svg(frames: Sequence[Frame], colours: Colours) -> str:
    """The animation as one document."""
    seconds = len(frames) * EVERY / 10 / FASTER
    walls = "".join(f'<polyline points="{points(wall)}"/>' for wall in WALLS)
    path = " ".join(f"{x(one.pose):.1f},{y(one.pose):.1f}" for one in frames)
    boxes = "".join(box(name, top) for name, top in BOXES.items())
    states = "\n".join(lit(name, frames, colours) for name in BOXES)
    size = f'viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}"'
    return f"""<svg xmlns="http://www.w3.org/2000/svg" {size} role="img">
<title>A robot drives through a spiral; the active state of its machine is lit</title>
<style>
text {{ font: 14px ui-monospace, monospace; fill: {colours.text}; }}
.walls {{ fill: none; stroke: {colours.wall}; stroke-width: 4; stroke-linejoin: round; stroke-linecap: round; }}
.path {{ fill: none; stroke: {colours.robot}; stroke-opacity: .35; stroke-width: 2; }}
.robot {{ fill: {colours.robot}; animation: drive {seconds:.1f}s linear infinite; }}
.box {{ fill: none; stroke: {colours.faint}; stroke-width: 1.5; }}
.arrow {{ fill: none; stroke: {colours.faint}; stroke-width: 1.5; }}
.head {{ fill: {colours.faint}; }}
.lamp {{ fill: {colours.lit}; opacity: 0; animation-duration: {seconds:.1f}s; animation-timing-function: step-end;
  animation-iteration-count: infinite; }}
#driving {{ opacity: 1; }}
@keyframes drive {{ {moves(frames)} }}
{states}
@media (prefers-reduced-motion: reduce) {{ * {{ animation: none !important; }} }}
</style>
<g class="walls">{walls}</g>
<polyline class="path" points="{path}"/>
<g class="robot" style="transform: {place(frames[0])}"><path d="M -11 -13 H 7 A 13 13 0 0 1 7 13 H -11 Z"/></g>
{boxes}
<path class="arrow" d="M 352 76 V 98 M 402 104 V 82 M 330 120 H 318 V 238 H 324 M 424 60 H 444 V 188 H 430"/>
<path class="head" d="M 348 97 h 8 l -4 7 z M 398 83 h 8 l -4 -7 z M 323 234 v 8 l 7 -4 z M 431 184 v 8 l -7 -4 z"/>
</svg>
"""


def box(name: str, top: int) -> str:
    """A state: its lamp, its frame and its name."""
    frame = f'x="330" y="{top}" width="94" height="32" rx="6"'
    text = f'<text x="377" y="{top + 21}" text-anchor="middle" class="{name}">{name}</text>'
    return f'<rect id="{name}" class="lamp" {frame}/><rect class="box" {frame}/>{text}\n'


def lit(name: str, frames: Sequence[Frame], colours: Colours) -> str:
    """The style that lights a state's lamp while the state is active."""
    lamps, words, before = [], [], None
    for index, frame in enumerate(frames):
        active = frame.state == name
        if active is not before:
            at = f"{100 * index / len(frames):.2f}%"
            lamps.append(f"{at} {{ opacity: {int(active)}; }}")
            words.append(f"{at} {{ fill: {colours.lit_text if active else colours.text}; }}")
            before = active
    seconds = len(frames) * EVERY / 10 / FASTER
    return (
        f"#{name} {{ animation-name: {name}; }} @keyframes {name} {{ {' '.join(lamps)} }}\n"
        f".{name} {{ animation: {name}-text {seconds:.1f}s step-end infinite; }}"
        f" @keyframes {name}-text {{ {' '.join(words)} }}"
    )


def moves(frames: Sequence[Frame]) -> str:
    """The key frames of the robot."""
    last = len(frames) - 1
    return " ".join(f"{100 * index / last:.2f}% {{ transform: {place(one)}; }}" for index, one in enumerate(frames))


def place(frame: Frame) -> str:
    """The robot's transform in the picture; angles are clockwise there."""
    return f"translate({x(frame.pose):.1f}px,{y(frame.pose):.1f}px) rotate({-frame.pose.heading:.2f}rad)"


def x(pose: Pose) -> float:
    """Pixels from the left."""
    return MARGIN + pose.x * SCALE


def y(pose: Pose) -> float:
    """Pixels from the top."""
    return HEIGHT - MARGIN - pose.y * SCALE


def points(wall: Sequence[float]) -> str:
    """A wall as pixels."""
    corners = zip(wall[::2], wall[1::2], strict=True)
    return " ".join(f"{MARGIN + across * SCALE:.0f},{HEIGHT - MARGIN - up * SCALE:.0f}" for across, up in corners)


if __name__ == "__main__":
    main()
