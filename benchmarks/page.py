"""What the page of a run costs: its size without data, the first picture, a redraw, in headless Chromium.

A run of pledge is repeated until it has enough ticks, so the path is drawn several times over. Use a quiet machine.

Run as ``python -P benchmarks/page.py --ticks 8000``.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

from playwright.sync_api import sync_playwright

from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import drive, prepare
from maze_machine.report.pages import ShownRun, run_head
from maze_machine.simulated.world import SimulatedWorld, find_maze
from maze_machine.view.drawings import Drawings
from maze_machine.view.page import Frame, live_page, replay_page
from transport.description import RobotDescription
from transport.world import LockstepRobot

SECONDS = 60.0
"""How long the run is that is repeated."""
REDRAWS = 41


def recorded(ticks: int) -> tuple[dict[str, Any], list[Frame]]:
    """The constant part of a page, and a number of ticks."""
    mission = prepare("pledge", load_profile(), time_limit=SECONDS)
    world = SimulatedWorld(find_maze("final_2015", robot=RobotDescription()), mission.profile.robot)
    robot, frames = LockstepRobot(world), list[Frame]()
    drive(mission, robot, robot, [ShownRun(lambda make: frames.append(make()), lambda _: None)], truth=world.pose)
    period = round(mission.profile.robot.period * 1e9)
    repeated = (frames[tick % len(frames)] for tick in range(ticks))
    return (
        {**run_head(mission, world), "drawings": Drawings(mission.machine).all()},
        [{**frame, "tick": tick, "stamp": tick * period} for tick, frame in enumerate(repeated)],
    )


def main() -> None:
    """Measure, and print the figures."""
    parser = argparse.ArgumentParser(description="What the page of a run costs.")
    parser.add_argument("--ticks", type=int, default=8000)
    ticks = parser.parse_args().ticks
    head, frames = recorded(ticks)
    empty = {**head, "drawings": {}, "sources": {}, "model": None, "scene": None}
    print(f"page without data    {len(live_page(empty, '')) / 1000:8.0f} kB")
    with TemporaryDirectory() as folder, sync_playwright() as playwright:
        file = Path(folder) / "run.html"
        file.write_text(replay_page(head, frames), encoding="utf-8")
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        began = perf_counter()
        page.goto(file.as_uri(), wait_until="commit")
        page.wait_for_selector("body[data-shown]")
        print(f"first picture        {perf_counter() - began:8.2f} s")
        page.wait_for_selector("body[data-ready]")
        print(f"all ticks            {perf_counter() - began:8.2f} s")
        for part in (0.1, 0.5, 1.0):
            last = round(part * ticks) - 1
            page.evaluate(f"app.redraw({last - REDRAWS})")
            took = page.evaluate(f"[...Array({REDRAWS})].map((_, one) => app.redraw({last - REDRAWS + 1} + one))")
            print(f"redraw at tick {last:6d} {median(took):7.1f} ms, at most {max(took):.1f} ms")
        browser.close()


if __name__ == "__main__":
    main()
