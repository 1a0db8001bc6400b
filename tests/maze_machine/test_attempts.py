"""Two attempts in the time limit, as the challenge grants them, and a second one for practice."""

import json
from contextlib import nullcontext

import pytest

from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.attempts import attempts
from maze_machine.drive.mission import prepare
from maze_machine.simulated.settings import simulator_settings
from maze_machine.simulated.world import SimulatedWorld, find_maze
from transport.description import RobotDescription
from transport.messages import STOP
from transport.world import LockstepRobot

LOST = "command_lost at=5 lasts=3"
"""The last command holds meanwhile: straight on, into the wall."""

IDLE = """\
machine idle
initial waiting
state waiting
    do stop()
    after 1 s -> gave_up
final gave_up
"""


BRANCH = """\
limit 300
start 0.5 0.5 90
wall  0 0  1 0  1 2  3 2  3 5                 # a way to the right, and round a bend the exit
wall  2 5  2 3  1 3  1 8  0 8  0 0            # straight on a dead end
exit  3 5  2 5
"""


@pytest.fixture
def made(tmp_path):
    """Make attempts: each with its ticks, and the referee's verdicts."""
    idle = tmp_path / "idle.maze-machine"
    idle.write_text(IDLE)

    def run(machine="idle", maze="corridor", *, most=2, rules=(), faults=(), seed=0, time_limit=None):
        mission = prepare(str(idle) if machine == "idle" else machine, load_profile(), time_limit=time_limit)
        world = SimulatedWorld(
            find_maze(maze, robot=RobotDescription()), mission.profile.robot, seed, simulator_settings(rules, faults)
        )
        ticks = {}

        def watchers(number):
            return nullcontext([ticks.setdefault(number, []).append])

        found = []
        for attempt in attempts(mission, lambda: LockstepRobot(world), watchers, most, world.try_again):
            assert len(attempt.trail.times) == len(ticks[attempt.number]) == attempt.ending.ticks
            assert len(world.path) == attempt.ending.ticks + 1
            assert world.pose(0) == world.path[0]
            found.append((attempt, ticks[attempt.number], list(world.path)))
        return found, world.attempts()

    return run


def test_a_failed_attempt_is_followed_by_one_from_the_start_with_a_fresh_machine(made):
    (one, two), verdicts = made("pledge", "final_2015", faults=[LOST])
    assert [(verdict["attempt"], verdict["outcome"]) for verdict in verdicts] == [
        (1, "touched something"),
        (2, "escaped"),
    ]
    (first, first_ticks, first_path), (second, second_ticks, second_path) = one, two
    assert (first.ending.report["escaped"], second.ending.report["escaped"]) == (False, True)
    assert [ticks[0].index for ticks in (first_ticks, second_ticks)] == [0, 0]
    assert second_ticks[0].configuration == first_ticks[0].configuration
    assert second_path[0] == first_path[0], "this maze's start has no spread"
    assert second_path[1] == second_path[0], "the robot begins at a standstill"
    assert second_ticks[0].command.twist == STOP
    assert second_ticks[0].time == pytest.approx(first_ticks[-1].time + 0.1), "time runs on"


def test_there_is_no_second_attempt_after_a_success_nor_where_one_was_asked_for(made):
    found, verdicts = made("corridor_2017")
    assert [verdict["outcome"] for verdict in verdicts] == ["escaped"]
    found, verdicts = made("pledge", "final_2015", most=1, faults=[LOST])
    assert [verdict["outcome"] for verdict in verdicts] == ["touched something"]
    assert len(found) == 1


def test_both_attempts_share_the_time_limit(made, tmp_path):
    maze = tmp_path / "short.maze"
    maze.write_text("limit 20\nwall 0 0  3 0  3 3  2 3\nwall 1 3  0 3  0 0\nexit 2 3  1 3\nstart 1.5 1.5 90\n")
    found, verdicts = made(maze=str(maze), rules=["rules.still_limit=12"])
    assert [verdict["outcome"] for verdict in verdicts] == ["stood still for too long", "still inside"]
    found, verdicts = made(maze=str(maze), rules=["rules.still_limit=25"])
    assert [verdict["outcome"] for verdict in verdicts] == ["ran out of time"]
    assert len(found) == 1


def test_a_robot_whose_machine_gave_up_inside_stands_until_the_attempt_has_failed(made):
    (one, two), verdicts = made()
    assert [attempt.ending.outcome for attempt, *_ in (one, two)] == ["gave_up", "gave_up"]
    assert [verdict["outcome"] for verdict in verdicts] == ["stood still for too long", "still inside"]
    assert verdicts[0]["time"] == pytest.approx(30.0)
    assert two[1][0].time == pytest.approx(30.0)


def test_an_attempt_that_reaches_the_limit_of_the_run_is_the_last(made):
    found, verdicts = made(time_limit=0.5)
    assert [verdict["outcome"] for verdict in verdicts] == ["still inside"]
    assert found[0][0].ending.limited


@pytest.mark.parametrize("seed", [0, 3])
def test_one_seed_gives_the_same_ticks_in_both_attempts(made, seed):
    def told():
        found, _ = made("corridor_2017", rules=["rules.practice=true"], seed=seed)
        assert [attempt.ending.report["outcome"] for attempt, *_ in found] == ["escaped", "escaped"]
        return [[(tick.observation.stamp, tick.pose, tick.command) for tick in ticks] for _, ticks, _ in found]

    once = told()
    assert once == told()
    assert once[0] != once[1], "noise continues, it does not begin anew"


@pytest.mark.parametrize("seed", [0, 1])
def test_in_practice_tremaux_explores_first_and_then_drives_straight_out(made, tmp_path, seed):
    maze = tmp_path / "branch.maze"
    maze.write_text(BRANCH)
    found, verdicts = made("tremaux", str(maze), rules=["rules.practice=true"], seed=seed)
    explored, direct = (verdict["path_length"] for verdict in verdicts)
    assert [(verdict["escaped"], verdict["contacts"]) for verdict in verdicts] == [(True, []), (True, [])]
    assert explored > 14
    assert direct < 8
    doing = [{tick.doing for tick in ticks} for _, ticks, _ in found]
    assert ["turn_180" in states for states in doing] == [True, False]


def test_in_practice_explorer_keeps_its_map_and_drives_the_way_out(made):
    found, verdicts = made("explorer", "final_2015", rules=["rules.practice=true"])
    explored, direct = (verdict["path_length"] for verdict in verdicts)
    assert [(verdict["escaped"], verdict["contacts"]) for verdict in verdicts] == [(True, []), (True, [])]
    assert direct < 0.85 * explored
    doing = {tick.doing for _, ticks, _ in found for tick in ticks}
    assert not any(state.startswith("by_pledge") for state in doing)


def test_what_a_failed_attempt_has_seen_is_forgotten(made, tmp_path):
    maze = tmp_path / "branch.maze"
    maze.write_text(BRANCH)
    # By then it has come back from the dead end.
    found, verdicts = made("tremaux", str(maze), faults=["command_lost at=25 lasts=20"], rules=["rules.practice=true"])
    assert [verdict["outcome"] for verdict in verdicts] == ["touched something", "escaped"]
    doing = [{tick.doing for tick in ticks} for _, ticks, _ in found]
    assert ["turn_180" in states for states in doing] == [True, True]


def test_the_command_makes_two_attempts_with_files_for_each(finish, tmp_path):
    told = (
        "--attempts",
        2,
        "--time-limit",
        9,
        "--fault",
        LOST,
        "--trace",
        "run.jsonl",
        "--record",
        "run.mcap",
        "--json",
    )
    status, out, err = finish("run", "pledge", *told)
    assert (status, err) == (1, "")
    result = json.loads(out)
    assert [attempt["outcome"] for attempt in result["attempts"]] == ["touched something", "still inside"]
    assert result["verdict"]["attempt"] == 2
    for kind, file in (("trace", "run.jsonl"), ("recording", "run.mcap")):
        assert result["files"][kind] == file
        assert result["files"][f"{kind} 2"] == file.replace(".", "-2.")
    assert all((tmp_path / file).exists() for file in result["files"].values())
    assert len(set(result["files"].values())) == 6
    # Each recording is a run of its own.
    assert finish("replay", "run-2.mcap")[0] == 0


def test_a_run_of_one_attempt_fails_with_it(finish):
    status, out, _ = finish("run", "pledge", "--fault", LOST, "--no-picture")
    assert status == 1
    assert "failed: touched" in out
    assert "attempt" not in out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--attempts", 2, "--connect", "tcp/127.0.0.1"), "`tcp/127.0.0.1` is not an endpoint"),
        (("--practice", "--record", "run.mcap"), "--record cannot be combined with --practice"),
    ],
)
def test_what_cannot_be_is_said(finish, options, message):
    status, out, err = finish("run", "pledge", *options)
    assert (status, out) == (2, "")
    assert message in err
