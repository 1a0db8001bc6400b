"""A recording as a file of the viewer Rerun, made by Rerun's own reader."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from maze_machine.errors import FileError, missing_package
from transport.files import write_bytes

LONGEST = 300.0
"""Rerun is not waited for longer, s."""


def to_rerun(recording: Path, output: Path) -> None:
    """Write a recording for Rerun.

    Args:
        recording: an MCAP file.
        output: the .rrd file.

    Raises:
        UsageError: Rerun is not installed.
        FileError: Rerun cannot read the recording, or takes too long.
        OSError: the file cannot be written.
    """
    if find_spec("rerun") is None:
        raise missing_package("a .rrd file", "Rerun (170 MB)", "rerun")
    if not recording.is_file():
        raise FileError(f"there is no recording {recording}")
    with TemporaryDirectory() as folder:
        made = Path(folder) / "run.rrd"
        command = [sys.executable, "-m", "rerun", "mcap", "convert", str(recording.resolve()), "-o", str(made)]
        environment = {**os.environ, "DO_NOT_TRACK": "1", "RERUN_ANALYTICS_DISABLED": "1"}
        try:
            ended = subprocess.run(
                command, env=environment, capture_output=True, text=True, timeout=LONGEST, check=False
            )
        except subprocess.TimeoutExpired:
            raise FileError(f"Rerun has not read {recording} within {LONGEST:g} s") from None
        if ended.returncode or not made.exists():
            said = (ended.stderr.strip().splitlines() or ["it gave no reason"])[-1]
            raise FileError(f"Rerun cannot read {recording}: {said[:300]}")
        write_bytes(output, made.read_bytes())
