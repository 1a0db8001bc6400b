"""One seed, one trace on every processor: numpy's kernels are chosen by hand, and nothing that decides may use them."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DECIDING = ("hsm", "perception", "sim", "skills", "transport")

PROGRAM = """
import hashlib, json
import numpy as np
from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import drive, prepare
from maze_machine.simulated.world import SimulatedWorld, find_maze
from transport.world import LockstepRobot

digest = hashlib.sha256()
for name, maze in (("pledge", "final_2015"), ("tremaux", "final_2015"), ("corridor_2015", "corridor")):
    mission = prepare(name, load_profile(), time_limit=12.0)
    robot = LockstepRobot(SimulatedWorld(find_maze(maze), mission.profile.robot, 3))

    def look(tick, machine=mission.machine):
        digest.update(json.dumps(tick.line).encode())
        digest.update(tick.observation.scan.ranges.tobytes())

    drive(mission, robot, robot, [look])
x = np.random.default_rng(1).random((2, 300))
print(digest.hexdigest(), hashlib.sha256((x @ x.T).tobytes() + np.arctan2(*x).tobytes()).hexdigest()[:8])
"""

KERNELS = (
    {"OPENBLAS_CORETYPE": "Prescott"},
    {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "X86_V4 X86_V3 AVX512_ICL AVX512_SPR"},
    {"OPENBLAS_CORETYPE": "SkylakeX"},
)


def test_three_kernels_make_one_trace():
    """The second word that each process prints shows that the kernels differ where they are used."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    processes = [
        subprocess.Popen(
            [sys.executable, "-W", "ignore", "-c", PROGRAM],
            env=environment | kernel,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for kernel in KERNELS
    ]
    told = [process.communicate(timeout=120) for process in processes]
    assert [process.returncode for process in processes] == [0, 0, 0], told
    digests, controls = zip(*(out.split() for out, _ in told), strict=True)
    assert len(set(digests)) == 1
    if len(set(controls)) == 1:
        pytest.skip("numpy has one kernel only here")


BY_PROCESSOR = {
    "np": {
        *("dot", "vdot", "inner", "matmul", "einsum", "tensordot", "linalg", "convolve", "correlate", "polyfit"),
        *("sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2", "exp", "exp2", "expm1", "hypot", "power"),
        *("log", "log2", "log10", "log1p", "sinh", "cosh", "tanh", "cbrt", "unwrap", "angle", "cov", "corrcoef"),
    },
    "math": {"hypot", "dist", "sumprod", "pow"},
}
ALLOWED = {
    # Which beams may meet a wall; whether they do is decided by the four operations.
    ("sim/lidar.py", "np.arctan2"),
}


def found_in(path: Path) -> Iterator[str]:
    """What depends on the processor or the interpreter in a module, by name."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, ast.MatMult):
            yield "@"
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.attr in BY_PROCESSOR.get(node.value.id, ()):
                yield f"{node.value.id}.{node.attr}"
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            stable = any(
                word.arg == "kind" and isinstance(word.value, ast.Constant) and word.value.value == "stable"
                for word in node.keywords
            )
            if node.func.attr in ("argsort", "argpartition") and not stable:
                yield node.func.attr


def test_nothing_that_decides_uses_what_depends_on_the_processor():
    found = {
        (path.relative_to(ROOT).as_posix(), name)
        for room in DECIDING
        for path in (ROOT / room).rglob("*.py")
        for name in found_in(path)
    }
    assert found == ALLOWED


@pytest.mark.parametrize(
    ("line", "name"),
    [("a @ b", "@"), ("a @= b", "@"), ("np.hypot(a, b)", "np.hypot"), ("np.linalg.inv(a)", "np.linalg"),
     ("a.argsort()", "argsort"), ("np.argsort(a, kind='stable')", None), ("np.sqrt(a)", None)],
)  # fmt: skip
def test_the_search_finds_them(tmp_path, line, name):
    file = tmp_path / "module.py"
    file.write_text(line)
    assert list(found_in(file)) == ([] if name is None else [name])
