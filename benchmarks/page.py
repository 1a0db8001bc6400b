"""What the page of a run costs: its size without data, the first picture, a redraw, in headless Chromium.

A run of pledge is repeated until it has enough ticks, so the path is drawn several times over. Use a quiet machine;
the processor time of a redraw, which includes that of the question for it, depends less on what else runs.
``--hours`` measures something else: what a live page and its server keep in memory while hours of ticks pass.

Run as ``python -P benchmarks/page.py --ticks 8000`` or ``python -P benchmarks/page.py --hours 2``.
"""

from __future__ import annotations

import argparse
import gc
import json
import shutil
from functools import partial
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

from playwright.sync_api import CDPSession, sync_playwright

from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import drive, prepare
from maze_machine.report.pages import ShownRun, run_head
from maze_machine.simulated.world import SimulatedWorld, find_maze
from maze_machine.view.drawings import Drawings
from maze_machine.view.live import LivePage
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


def remember(hours: float) -> None:
    """Print what a live page and its server keep while ticks pass as fast as the page takes them."""
    head, frames = recorded(round(SECONDS * 10))
    ticks, period = round(hours * 36_000), round(head["period"] * 1e9)
    with (
        LivePage({**head, "drawings": {}}, drawn=head["drawings"].__getitem__) as served,
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 800}, bypass_csp=True)
        page.goto(served.address)
        inspected = page.context.new_cdp_session(page)
        for tick in range(ticks):
            # Through JSON, since a real run shares no values between ticks.
            text = json.dumps({**frames[tick % len(frames)], "tick": tick, "stamp": tick * period})
            served.publish(partial(json.loads, text))
            if (tick + 1) % (ticks // 12) == 0:
                page.wait_for_function(f"store.frames.length && store.frames[store.frames.length - 1].tick === {tick}")
                inspected.send("HeapProfiler.collectGarbage")
                heap = inspected.send("Runtime.getHeapUsage")["usedSize"] / 1e6
                gc.collect()
                resident = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * 4096 / 1e6
                print(f"{(tick + 1) / 36_000:5.2f} h   page {heap:6.1f} MB   server {resident:6.1f} MB", flush=True)
        browser.close()


def main() -> None:
    """Measure, and print the figures."""
    parser = argparse.ArgumentParser(description="What the page of a run costs.")
    parser.add_argument("--ticks", type=int, default=8000)
    parser.add_argument("--hours", type=float)
    asked = parser.parse_args()
    if asked.hours is not None:
        remember(asked.hours)
        return
    ticks = asked.ticks
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
        inspected = page.context.new_cdp_session(page)
        inspected.send("Performance.enable", {"timeDomain": "threadTicks"})
        for part in (0.1, 0.5, 1.0):
            last = round(part * ticks) - 1
            page.evaluate(f"app.redraw({last - REDRAWS})")
            took, spent = list[float](), list[float]()
            for tick in range(last - REDRAWS + 1, last + 1):
                before = processor_time(inspected)
                took.append(page.evaluate(f"app.redraw({tick})"))
                spent.append(processor_time(inspected) - before)
            print(
                f"redraw at tick {last:6d} {median(took):7.1f} ms, at most {max(took):.1f} ms; "
                f"processor time {median(spent):.1f} ms, at most {max(spent):.1f} ms"
            )
        browser.close()


def processor_time(inspected: CDPSession) -> float:
    """What the page's thread has spent since it began, ms, with layout, painting and garbage, without waiting."""
    metrics = {one["name"]: one["value"] for one in inspected.send("Performance.getMetrics")["metrics"]}
    return 1e3 * float(metrics["TaskDuration"])


if __name__ == "__main__":
    main()
