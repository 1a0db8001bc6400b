"""Rerun's own reader opens a recording, where it is installed: its wheel has 170 MB, so nothing here asks for it."""

import os
import subprocess
import sys

import numpy as np
import pytest
from toy_world import ToyWorld, wander

from transport.messages import Pose
from transport.recording import RecordedScene, Recorder
from transport.recording.drawings import Grid
from transport.world import LockstepRobot

pytest.importorskip("rerun")


def test_rerun_reads_every_topic(tmp_path):
    robot = LockstepRobot(ToyWorld(3))
    grid = Grid(np.zeros((3, 4), dtype=np.int8), 0.5, 0.0, 0.0)
    setting = RecordedScene(((0.1, 0.1), (-0.1, 0.1), (0.0, -0.1)), Pose(), grid)
    with Recorder(tmp_path / "run.mcap", "toy", setting=setting, patience=10.0) as recorder:
        for _ in range(20):
            observation = robot.observe()
            recorder.record(observation, wander(observation), lambda: {"regions": {"toy": "wandering"}}, pose=Pose())
            robot.command(wander(observation))
    environment = {**os.environ, "DO_NOT_TRACK": "1", "RERUN_ANALYTICS_DISABLED": "1"}

    def rerun(*arguments):
        command = [sys.executable, "-m", "rerun", *arguments]
        ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=False)
        assert ended.returncode == 0, ended.stderr
        return ended.stdout + ended.stderr

    rerun("mcap", "convert", str(tmp_path / "run.mcap"), "-o", str(tmp_path / "run.rrd"))
    read = rerun("rrd", "print", str(tmp_path / "run.rrd"))
    for topic in ("/toy/scan", "/toy/path", "/toy/footprint", "/toy/state/toy", "/toy/tick"):
        assert f"- {topic} -" in read
    # What Rerun draws: the plan, the hits of the laser, and the frames that place them.
    drawn_as = {"/map": "GridMap", "/toy/points": "Points3D", "/tf": "Transform3D", "/tf_static": "Transform3D"}
    for topic, drawn in drawn_as.items():
        assert any(f"- {topic} -" in line and drawn in line for line in read.splitlines()), topic
