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
import hashlib, json, math
import numpy as np
from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import drive, prepare
from maze_machine.simulated.world import SimulatedWorld, find_maze
from sim.settings import LaserNoise, OdometryNoise, SimulatorSettings
from transport.world import LockstepRobot

noisy = SimulatorSettings(noise=LaserNoise(model="gaussian"), odometry=OdometryNoise(slip=0.01))
digest = hashlib.sha256()
for name, maze, settings, limit in (
    ("pledge", "final_2015", None, 12.0),
    ("explorer", "final_2015", noisy, 8.0),
    ("corridor_2015", "corridor", noisy, 8.0),
    ("tremaux", "dynamic", None, 8.0),
):
    mission = prepare(name, load_profile(), time_limit=limit)
    body = mission.profile.robot
    robot = LockstepRobot(SimulatedWorld(find_maze(maze, robot=body), body, 3, settings))

    def look(tick):
        digest.update(json.dumps(tick.line).encode())
        digest.update(tick.observation.scan.ranges.tobytes())

    drive(mission, robot, robot, [look])
x = np.random.default_rng(1).random((2, 3000))
kernels = (x @ x.T).tobytes() + np.arctan2(*x).tobytes() + json.dumps([math.sin(one) for one in x[0].tolist()]).encode()
print(digest.hexdigest(), hashlib.sha256(kernels).hexdigest()[:8])
"""

PROCESSORS = {
    "an old processor": {
        "OPENBLAS_CORETYPE": "Prescott",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F",
        "NPY_DISABLE_CPU_FEATURES": "X86_V4 X86_V3 AVX512_ICL AVX512_SPR",
    },
    "without fused multiplication": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4"},
    "Haswell": {
        "OPENBLAS_CORETYPE": "Haswell",
        "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    },
    "SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
    "plain functions": {"MAZE_MACHINE_PLAIN": "1"},
}


def test_one_seed_makes_one_trace_on_every_processor():
    """The second word that each process prints shows that the kernels differ where they are used."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    processes = [
        subprocess.Popen(
            [sys.executable, "-W", "ignore", "-c", PROGRAM],
            env=environment | processor,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for processor in PROCESSORS.values()
    ]
    told = [process.communicate(timeout=240) for process in processes]
    assert [process.returncode for process in processes] == [0] * len(PROCESSORS), told
    digests, controls = zip(*(out.split() for out, _ in told), strict=True)
    assert len(set(digests)) == 1, dict(zip(PROCESSORS, digests, strict=True))
    if len(set(controls)) == 1:
        pytest.skip("there is one kernel only here")


BY_PROCESSOR = {
    "np": {
        *("dot", "vdot", "inner", "matmul", "einsum", "tensordot", "linalg", "convolve", "correlate", "polyfit"),
        *("sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2", "exp", "exp2", "expm1", "hypot", "power"),
        *("log", "log2", "log10", "log1p", "sinh", "cosh", "tanh", "cbrt", "unwrap", "angle", "cov", "corrcoef"),
    },
    "math": {
        *("hypot", "dist", "sumprod", "pow", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh"),
        *("tanh", "asinh", "acosh", "atanh", "exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "cbrt"),
        *("gamma", "lgamma", "erf", "erfc"),
    },
}
DRAWS = {"standard_normal", "normal", "lognormal", "exponential", "standard_exponential", "gauss", "gammavariate"}
ALLOWED = {
    # Which beams may meet a wall; whether they do is decided by the four operations.
    ("sim/lidar.py", "np.arctan2"),
}


def found_in(path: Path) -> Iterator[str]:
    """What depends on the processor or the interpreter in a module, by name."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, ast.MatMult):
            yield "@"
        elif isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, ast.Pow):
            base = node.left if isinstance(node, ast.BinOp) else node.target
            if not (isinstance(base, ast.Constant)):
                yield "**"
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.attr in BY_PROCESSOR.get(node.value.id, ()):
                yield f"{node.value.id}.{node.attr}"
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "sum":
            yield "sum"
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            stable = any(
                word.arg == "kind" and isinstance(word.value, ast.Constant) and word.value.value == "stable"
                for word in node.keywords
            )
            if node.func.attr in DRAWS:
                yield node.func.attr
            if node.func.attr in ("argsort", "argpartition") and not stable:
                yield node.func.attr


def test_nothing_that_decides_uses_what_depends_on_the_processor():
    found = {
        (path.relative_to(ROOT).as_posix(), name)
        for room in DECIDING
        for path in (ROOT / room).rglob("*.py")
        if "testing" not in path.parts
        for name in found_in(path)
        if (room, name) != ("hsm", "sum")  # of numbers of states
    }
    assert found == ALLOWED


@pytest.mark.parametrize(
    ("line", "name"),
    [("a @ b", "@"), ("a @= b", "@"), ("np.hypot(a, b)", "np.hypot"), ("np.linalg.inv(a)", "np.linalg"),
     ("a.argsort()", "argsort"), ("np.argsort(a, kind='stable')", None), ("np.sqrt(a)", None),
     ("math.sin(a)", "math.sin"), ("a**2", "**"), ("2**31", None), ("sum(a)", "sum"),
     ("draw.standard_normal(3)", "standard_normal")],
)  # fmt: skip
def test_the_search_finds_them(tmp_path, line, name):
    file = tmp_path / "module.py"
    file.write_text(line)
    assert list(found_in(file)) == ([] if name is None else [name])
