"""Every field of every question at its bounds and one beyond, by the schema: answered or refused, and survived."""

import json
import threading
import zlib

import pytest

from hsm.interchange.reports import model_json
from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import drive, prepare
from maze_machine.remote import messages
from maze_machine.remote.opened import OpenRun
from maze_machine.remote.operated import OperatedRun
from maze_machine.simulated.world import SimulatedWorld, find_maze
from tests.transport.serving import serving
from transport.connect import open_robot
from transport.description import RobotDescription
from transport.gate import Gate, PacedWorld
from transport.lockstep import LockstepServer
from transport.memory_bus import MemoryNetwork
from transport.messages import Command, Twist
from transport.session import PROTOCOL, Ask, Close, Granted, Open, Refused, Retry, SessionState, Unread, read_answer
from transport.settings import LinkSettings
from transport.world import LockstepRobot

PICO = RobotDescription()
PATIENT = LinkSettings(dead_man=20.0, answer_age=20.0, silence=20.0, stale=20.0, patience=60.0)
GOOD = {
    **{"request": "a", "controller": "me", "secret": "0123456789abcdef" * 2, "attempt": 2, "protocol": PROTOCOL},
    **{"name": "go", "parameter": "pace", "value": "0.2 m/s", "at": "moving"},
}
OTHER = ("null", "true", "0.5", "1e400", "NaN", "-0", '"1"', "[]", "{}", '"\\ud800"', '"\\u0000"', "[" * 3000)
"""JSON texts of other types, and texts that are no JSON."""
LEFT_OUT = ""


def at_bounds(rule):
    """The JSON texts at the bounds of a field's schema and one beyond them, and whether each is within."""
    if "anyOf" in rule:
        yield "null", True
        rule = next(one for one in rule["anyOf"] if one["type"] != "null")
    if "const" in rule:
        yield json.dumps(rule["const"]), True
        yield json.dumps(rule["const"] + "x"), False
    elif rule["type"] == "string":
        least, most = rule.get("minLength", 0), rule["maxLength"]
        yield from ((json.dumps("a" * length), True) for length in (least, most))
        yield from ((json.dumps("a" * length), False) for length in (least - 1, most + 1) if length >= 0)
        any_text = "pattern" not in rule
        yield from ((json.dumps(text), any_text) for text in ("A", "a\n", "\N{RIGHT-TO-LEFT OVERRIDE}", "é"))
    else:
        step = 1 if rule["type"] == "integer" else 1e-9
        least, most = rule["minimum"], rule.get("maximum", rule.get("exclusiveMaximum", 0) - 1)
        yield from ((str(value), True) for value in (least, most))
        yield from ((str(value), False) for value in (least - step, most + step, -(10**400), 10**400))


def written(question, field, text):
    """A good question whose field has this JSON text."""
    fields = {name: json.dumps(GOOD.get(name, one.default)) for name, one in question.model_fields.items()}
    fields[field] = text
    return ("{" + ", ".join(f'"{name}": {value}' for name, value in fields.items() if value != LEFT_OUT) + "}").encode()


def trials(questions):
    """Question, field, JSON text, and whether it is valid; None where only an answer is required."""
    for question in questions:
        schema = question.model_json_schema()
        for field, rule in schema["properties"].items():
            for text, valid in at_bounds(rule):
                yield question, field, text, valid and (field != "protocol" or text == str(PROTOCOL))
            yield question, field, LEFT_OUT, field not in schema.get("required", ()) if field != "kind" else False
            for text in OTHER:
                yield question, field, text, None


def sealed(question):
    return b"%s\n%08x" % (question, zlib.crc32(question))


def world(seed):
    return SimulatedWorld(find_maze("corridor", robot=PICO), PICO, seed or 0)


def lockstep(bus):
    return LockstepServer(bus, "pico", PICO.period, world, patience=60.0)


def realtime(bus):
    return Gate(bus, PacedWorld(world, PICO.period), PICO, PATIENT)


def ask_all(bus, server, questions, answer_to_open):
    """Ask all that there is to try; how many questions that was."""
    refused, tried = server.dropped["malformed question"], 0
    for question, field, text, valid in trials(questions):
        tried += 1
        told = bus.ask("pico/session", sealed(written(question, field, text)), 20.0)
        assert told is not None, f"{question.__name__}.{field} = {text[:60]} has no answer"
        answer, counted = read_answer(told), server.dropped["malformed question"]
        taken, refused = counted == refused, counted
        assert valid is None or taken == valid, f"{question.__name__}.{field} = {text[:60]}: {answer}"
        expected = answer_to_open if question is Open else SessionState
        assert isinstance(answer, expected if taken else Refused | Unread)
        if isinstance(answer, Granted):
            bus.ask("pico/session", sealed(Close(secret=answer.secret).model_dump_json().encode()), 20.0)
    return tried


def step(robot):
    robot.command(Command(Twist(0.1), answers=robot.observe().stamp))


@pytest.mark.parametrize("serve", [lockstep, realtime])
def test_every_question_to_a_robots_side(serve):
    network = MemoryNetwork()
    server, stranger = serve(network.bus()), network.bus()
    with serving(server):
        robot = open_robot(network.bus(), PICO, PATIENT, seed=1)
        step(robot)
        assert ask_all(stranger, server, [Open, Close, Ask, Retry], Refused) > 200
        step(robot)
        robot.close()
        # An episode that is over cannot go on, which is a refusal without a count.
        assert ask_all(stranger, server, [Open], Granted | Refused) > 60
        robot = open_robot(network.bus(), PICO, PATIENT, seed=1)
        step(robot)
        step(robot)
        robot.close()
        assert set(server.dropped) == {"malformed question"}


MACHINE = """machine waiting

event go

param pace : speed = 0.2 m/s, adjustable(0.1 m/s, 0.3 m/s)

initial idle

state idle
    do stop()
    on go -> moving

state moving
    do drive(speed = pace)
    on go -> idle
"""
OPERATIONS = (
    *(messages.SetSpeed, messages.SendEvent, messages.SetParameter, messages.PauseAt),
    *(messages.Pause, messages.Resume, messages.AdvanceRun),
)


def test_every_question_to_a_running_machine(tmp_path):
    path = tmp_path / "waiting.maze-machine"
    path.write_text(MACHINE, encoding="utf-8")
    mission = prepare(str(path), load_profile("pico"), time_limit=1e6)
    network, ticks, tried = MemoryNetwork(), [], 0
    operated, asker = OperatedRun(mission, pausable=True), network.bus()
    with OpenRun(network.bus(), mission, operated, model_json(mission.machine.model, mission.parameters)) as opened:
        robot = LockstepRobot(world(0))
        watchers = [ticks.append, opened, operated]
        work = threading.Thread(target=lambda: drive(mission, robot, robot, watchers, operator=operated))
        work.start()
        for question, field, text, valid in trials(OPERATIONS):
            tried += 1
            answer = messages.Answer.model_validate_json(
                asker.ask("pico/machine/operate", written(question, field, text), 20.0)
            )
            # What is within the bounds may name nothing that there is.
            assert valid is not False or not answer.done, f"{question.__name__}.{field} = {text[:60]}"
            assert answer.done or answer.reason
        assert tried > 150
        for more in (messages.SetSpeed(factor=None), messages.PauseAt(at=""), messages.Resume()):
            asker.ask("pico/machine/operate", more.model_dump_json().encode(), 20.0)
        before, deadline = len(ticks), threading.Event()
        for _ in range(3000):
            if len(ticks) > before + 2:
                break
            deadline.wait(0.01)
        assert len(ticks) > before + 2, "the run goes on"
        asker.ask("pico/machine/operate", messages.EndRun().model_dump_json().encode(), 20.0)
        work.join(60)
        assert not work.is_alive()
