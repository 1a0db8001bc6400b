"""The page that shows a run: one self-contained HTML file, for a recording, a run in progress, or a robot elsewhere.

Its inputs are a head, the constant part, and frames, one per tick. A frame is a tick's JSON
(``docs/reference/tick.schema.json``) with ``ranges`` and the results of perception (``sights``); ``FrameEncoder``
leaves out values that did not change since the previous frame.

The head has ``title``, ``period`` (s), ``footprint`` (m), ``laser``, ``scene`` (``walls``, ``doors`` and ``exits`` as
x1, y1, x2, y2 in m; null if they are unknown), ``model`` (the machine; null where there is none), ``sources`` (the
text of its files by name), ``drawings`` (SVG, or a graph in DOT, by the compound state that is opened), ``undrawn``
(why there are none), ``operable``, and ``trial``: the ``signals`` of a machine that is tried without a robot, or null.
"""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from maze_machine.view.drawings import is_graph
from maze_machine.view.palette import DASHES, INKS
from transport.description import RobotDescription

FOLDER = Path(__file__).parent
SCRIPTS = ("data", "plan", "machine", "lanes", "why", "controls", "trial", "app")
"""The page's own scripts, in order; each uses the previous ones."""
LIBRARIES = (
    "d3-dispatch", "d3-selection", "d3-timer", "d3-ease", "d3-color", "d3-interpolate", "d3-transition", "d3-drag",
    "d3-zoom", "uPlot.iife",
)  # fmt: skip
VIZ = FOLDER / "vendor" / "viz-global.js"
"""Graphviz for browsers (viz-js): 1.3 MB, loaded only where a picture is a graph."""
KEYFRAME = 50
"""Every how many frames one is complete."""
FIRST = 100
"""How many ticks of a recording come before the page's scripts, which draw them while the rest is still read."""
STRIDE = 8
"""Every how many beams one is in the frames' ``ranges``."""
KEPT = frozenset(("tick", "stamp", "pose"))
"""What every frame says."""

Frame = Mapping[str, Any]


def head(
    title: str,
    robot: RobotDescription,
    scene: Mapping[str, Sequence[Sequence[float]]] | None = None,
    model: Mapping[str, Any] | None = None,
    sources: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """The constant part of a run.

    Args:
        title: what the page is called.
        robot: shape and laser.
        scene: ``walls``, ``doors`` and ``exits``; None if they are unknown: then the points of the laser are drawn.
        model: the machine, as ``hsm.interchange.reports.model_json`` gives it.
        sources: the text of the machine's files, by name.
    """
    laser = robot.laser
    return {
        "title": title,
        "period": robot.period,
        "footprint": robot.footprint,
        "laser": {
            "angle_min": laser.angle_min,
            "step": laser.geometry().angle_increment * STRIDE,
            "x": laser.mount_x,
            "y": laser.mount_y,
            "heading": laser.mount_heading,
        },
        "scene": scene,
        "model": model,
        "sources": dict(sources or {}),
        "drawings": {},
        "undrawn": "",
        "operable": False,
        "trial": None,
    }


def trial_head(
    title: str,
    period: float,
    model: Mapping[str, Any],
    sources: Mapping[str, str],
    signals: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """What does not change while a machine is tried without a robot.

    Args:
        title: what the page is called.
        period: from one tick to the next, s.
        model: the machine, as for ``head``.
        sources: the text of the machine's files, by name.
        signals: ``name`` as it is written, ``type`` and, of an enumeration, ``members`` of each signal.
    """
    still: dict[str, Any] = {
        "footprint": [],
        "laser": None,
        "scene": None,
        "drawings": {},
        "undrawn": "",
        "operable": True,
    }
    told = {"title": title, "period": period, "model": model, "sources": dict(sources)}
    return {**still, **told, "trial": {"signals": list(signals)}}


class FrameEncoder:
    """Encodes frames in order, each without the values that did not change since the previous one."""

    def __init__(self) -> None:
        self._before: Frame = {}
        self._count = 0

    def __call__(self, frame: Frame) -> bytes:
        """A frame as JSON: complete every ``KEYFRAME`` frames; in the others ``gone`` names removed keys."""
        whole = self._count % KEYFRAME == 0
        before = {} if whole else self._before
        said: dict[str, Any] = {
            name: value for name, value in frame.items() if name in KEPT or name not in before or before[name] != value
        }
        gone = [name for name in before if name not in frame]
        if gone:
            said["gone"] = gone
        if whole:
            said["whole"] = True
        self._before, self._count = frame, self._count + 1
        return json.dumps(said, separators=(",", ":"), default=str).encode()


def replay_page(head: Frame, frames: Iterable[Frame], verdict: Frame | None = None) -> str:
    """A self-contained page that shows a whole run.

    Args:
        head: what does not change.
        frames: the ticks.
        verdict: how the run ended, with ``lines`` for a person.
    """
    lines = list(map(FrameEncoder(), frames))
    packed = _packed(lines[:FIRST]), _packed(lines[FIRST:])
    graphs = any(map(is_graph, head["drawings"].values()))
    return _page({"head": head, "verdict": verdict, "live": False}, packed, [VIZ] if graphs else [])


def live_page(head: Frame, token: str) -> str:
    """A page that gets its frames from its server."""
    return _page({"head": head, "verdict": None, "live": True, "token": token}, ("", ""), [])


def _packed(lines: Sequence[bytes]) -> str:
    return base64.b64encode(gzip.compress(b"\n".join(lines), 6, mtime=0)).decode() if lines else ""


def _page(data: Mapping[str, Any], packed: tuple[str, str], more: Sequence[Path]) -> str:
    data = {**data, "palette": {"INKS": INKS, "DASHES": DASHES}}
    # Only "</" could end the data early, and "<!--" could hide the end; both are escaped.
    text = json.dumps(data, separators=(",", ":"), default=str).replace("<", "\\u003c")
    scripts = [one.read_text(encoding="utf-8") for one in more]
    scripts += [_text(f"vendor/{name}.min.js") for name in LIBRARIES] + [_text(f"{name}.js") for name in SCRIPTS]
    parts = {
        "/*STYLE*/": _text("vendor/uPlot.min.css") + _text("page.css"),
        "/*SCRIPT*/": "\n".join(scripts).replace("</script", "<\\/script"),
        "/*FRAMES*/": packed[0],
        "/*MORE*/": packed[1],
        "/*DATA*/null": text,
    }
    page = _text("page.html")
    for mark, content in parts.items():
        before, _, after = page.partition(mark)
        page = before + content + after
    return page


def _text(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")
