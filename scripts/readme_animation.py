"""Draw the animation of the README: the README's machine leaves a maze, and the state that is active is lit.

    python scripts/readme_animation.py

The machine and the maze are run in the simulator with seed 0. The pictures are SVG with CSS animations, for light
and for dark pages, in wide and in narrow windows. A reader who asked for less motion sees the path and the first state.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping, Sequence
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
MARGIN = 24
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


LIGHT = Colours("#1f2328", "#afb8c1", "#1f2328", "#0a7d6c", "#ffffff", "#d1540f")
DARK = Colours("#e6edf3", "#57606a", "#e6edf3", "#2dbfa8", "#06231f", "#ff9d5c")


@dataclass(frozen=True)
class Layout:
    """Where things are, in px.

    Attributes:
        size: of the picture, across and down.
        scale: of the maze, px for a metre.
        boxes: the left upper corner of each state's box.
        arrows: the lines between the boxes, as a path.
        heads: the heads of the arrows, as a path.
    """

    size: tuple[int, int]
    scale: float
    boxes: Mapping[str, tuple[int, int]]
    arrows: str
    heads: str

    def x(self, across: float) -> float:
        """Pixels from the left."""
        return MARGIN + across * self.scale

    def y(self, up: float) -> float:
        """Pixels from the top."""
        return MARGIN + (3 - up) * self.scale


BESIDE = Layout(
    (260, 340),
    53,
    {"driving": (12, 220), "turning": (154, 220), "outside": (12, 296), "stuck": (154, 296)},
    "M 106 230 H 148 M 154 242 H 112 M 59 252 V 290 M 201 252 V 290",
    "M 147 226 v 8 l 7 -4 z M 113 238 v 8 l -7 -4 z M 55 289 h 8 l -4 7 z M 197 289 h 8 l -4 7 z",
)
"""Narrow enough for a place beside the README's machine."""

ABOVE = Layout(
    (460, 264),
    64,
    {"driving": (330, 44), "turning": (330, 104), "outside": (330, 172), "stuck": (330, 222)},
    "M 352 76 V 98 M 402 104 V 82 M 330 120 H 318 V 238 H 324 M 424 60 H 444 V 188 H 430",
    "M 348 97 h 8 l -4 7 z M 398 83 h 8 l -4 -7 z M 323 234 v 8 l 7 -4 z M 431 184 v 8 l -7 -4 z",
)
"""For a narrow window, above the machine: as wide as that."""

VARIANTS = {
    "run-light.svg": (BESIDE, LIGHT),
    "run-dark.svg": (BESIDE, DARK),
    "run-light-narrow.svg": (ABOVE, LIGHT),
    "run-dark-narrow.svg": (ABOVE, DARK),
}


@dataclass(frozen=True)
class Frame:
    """One moment: the robot's true pose and the active state."""

    pose: Pose
    state: str


def main() -> None:
    """Run the machine and draw all variants."""
    frames = run()
    for name, (layout, colours) in VARIANTS.items():
        (IMAGES / name).write_text(svg(frames, layout, colours), encoding="utf-8")


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


def svg(frames: Sequence[Frame], layout: Layout, colours: Colours) -> str:
    """The animation as one document."""
    seconds = len(frames) * EVERY / 10 / FASTER
    walls = "".join(f'<polyline points="{points(wall, layout)}"/>' for wall in WALLS)
    path = " ".join(f"{layout.x(one.pose.x):.1f},{layout.y(one.pose.y):.1f}" for one in frames)
    boxes = "".join(box(name, *corner) for name, corner in layout.boxes.items())
    states = "\n".join(lit(name, frames, colours) for name in layout.boxes)
    width, height = layout.size
    size = f'viewBox="0 0 {width} {height}" width="{width}" height="{height}"'
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
@keyframes drive {{ {moves(frames, layout)} }}
{states}
@media (prefers-reduced-motion: reduce) {{ * {{ animation: none !important; }} }}
</style>
<g class="walls">{walls}</g>
<polyline class="path" points="{path}"/>
<g class="robot" style="transform: {place(frames[0], layout)}"><path d="M -9 -11 H 6 A 11 11 0 0 1 6 11 H -9 Z"/></g>
{boxes}
<path class="arrow" d="{layout.arrows}"/>
<path class="head" d="{layout.heads}"/>
</svg>
"""


def box(name: str, left: int, top: int) -> str:
    """A state: its lamp, its frame and its name."""
    frame = f'x="{left}" y="{top}" width="94" height="32" rx="6"'
    text = f'<text x="{left + 47}" y="{top + 21}" text-anchor="middle" class="{name}">{name}</text>'
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


def moves(frames: Sequence[Frame], layout: Layout) -> str:
    """The key frames of the robot."""
    last = len(frames) - 1
    return " ".join(
        f"{100 * index / last:.2f}% {{ transform: {place(one, layout)}; }}" for index, one in enumerate(frames)
    )


def place(frame: Frame, layout: Layout) -> str:
    """The robot's transform in the picture; angles are clockwise there."""
    across, down = layout.x(frame.pose.x), layout.y(frame.pose.y)
    return f"translate({across:.1f}px,{down:.1f}px) rotate({-frame.pose.heading:.2f}rad)"


def points(wall: Sequence[float], layout: Layout) -> str:
    """A wall as pixels."""
    corners = zip(wall[::2], wall[1::2], strict=True)
    return " ".join(f"{layout.x(across):.0f},{layout.y(up):.0f}" for across, up in corners)


if __name__ == "__main__":
    main()
