"""An editor for the debug adapter: debugpy's client, with every message held to the protocol's own JSON schema."""

import json
import queue
import socket
import threading
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import jsonschema
import pytest
from debugpy.common import messaging

from maze_machine.debug.adapter import Adapter
from maze_machine.debug.messages import Channel

LIMIT = 60.0
WALK = """machine walk

event go

param pause : time = 1 s

var turns : int = 0

initial idle

state idle
    do stop()
    on go    -> moving

state moving
    do drive(speed = 0.2 m/s)
    when space.left    -> turning    / turns += 1
    on blocked         -> idle

state turning
    do rotate(90 deg)
    on done        -> moving
    after pause    -> idle

property few : never turns > 2
"""


@cache
def schema():
    """The protocol's schema, as debugpy ships it: definitions by name."""
    inside = "_vendored/pydevd/_pydevd_bundle/_debug_adapter/debugProtocol.json"
    return json.loads((Path(find_spec("debugpy").origin).parent / inside).read_text(encoding="utf-8"))


@cache
def validator(name):
    whole = schema()
    return jsonschema.Draft4Validator({"$ref": f"#/definitions/{name}", "definitions": whole["definitions"]})


def check(message):
    """Hold a message of the adapter to the schema of its own kind."""
    if message["type"] == "event":
        name = f"{message['event'][0].upper()}{message['event'][1:]}Event"
    elif message["success"]:
        name = f"{message['command'][0].upper()}{message['command'][1:]}Response"
    else:
        name = "ErrorResponse"
    assert name in schema()["definitions"], name
    assert message["type"] == "event" or message.get("body") != {}, "strict clients refuse an empty body"
    validator(name).validate(message)


class CheckedStream(messaging.JsonIOStream):
    """debugpy's stream of messages, where each that comes is held to the schema."""

    def read_json(self, decoder=None):
        message = super().read_json(decoder)
        check(json.loads(json.dumps(message)))
        return message


class Events:
    """Takes what the adapter says by itself."""

    def __init__(self):
        self.queue = queue.Queue()

    def event(self, event):
        self.queue.put((event.event, dict(event.body)))


class Editor:
    """Asks the adapter and waits for what it says."""

    def __init__(self, stream):
        self.events = Events()
        self.said = []
        self.channel = messaging.JsonMessageChannel(stream, self.events)
        self.channel.start()
        self.capabilities = self.ask("initialize", adapterID="maze-machine", linesStartAt1=True)

    def ask(self, command, **arguments):
        """The body of the answer to a request that succeeds."""
        return self.channel.send_request(command, arguments).wait_for_response()

    def succeeds(self, command, **arguments):
        """Whether a request succeeds."""
        response = self.channel.send_request(command, arguments)
        response.wait_for_response(raise_if_failed=False)
        return response.response.success

    def refused(self, command, **arguments):
        """Why a request fails."""
        response = self.channel.send_request(command, arguments)
        response.wait_for_response(raise_if_failed=False)
        assert not response.response.success
        return str(response.response.body)

    def event(self, name):
        """The next event of a kind."""
        while True:
            found, body = self.events.queue.get(timeout=LIMIT)
            self.said.append((found, body))
            if found == name:
                return body

    # What an editor does.

    def launch(self, program, lines=(), named=(), **arguments):
        """Launch a machine with breakpoints; how it stops first."""
        self.ask("launch", program=str(program), **arguments)
        self.event("initialized")
        if lines:
            wanted = [one if isinstance(one, dict) else {"line": one} for one in lines]
            self.laid = self.ask("setBreakpoints", source={"path": str(program)}, breakpoints=wanted)["breakpoints"]
        if named:
            wanted = [{"name": one} for one in named]
            self.laid = self.ask("setFunctionBreakpoints", breakpoints=wanted)["breakpoints"]
        self.ask("configurationDone")
        return self.event("stopped")

    def go(self, command):
        """Move; how it stops."""
        self.ask(command, threadId=1)
        return self.event("stopped")

    def stack(self):
        """The names of the frames, the innermost first."""
        return [one["name"] for one in self.ask("stackTrace", threadId=1)["stackFrames"]]

    def scopes(self, frame=1):
        """The scopes of a frame, each with its values."""
        self.ask("stackTrace", threadId=1)
        found = self.ask("scopes", frameId=frame)["scopes"]
        self.references = {one["name"]: one["variablesReference"] for one in found}
        return {
            one["name"]: {
                item["name"]: item["value"]
                for item in self.ask("variables", variablesReference=one["variablesReference"])["variables"]
            }
            for one in found
        }

    def set(self, name, value):
        """Give a signal or a variable another value."""
        self.ask("setExpression", expression=name, value=value)


@pytest.fixture
def walk(tmp_path):
    """A machine's file."""
    path = tmp_path / "walk.maze-machine"
    path.write_text(WALK, encoding="utf-8")
    return path


@pytest.fixture
def editor():
    """An editor that is connected to an adapter in this process."""
    ours, theirs = socket.socketpair()
    ours.settimeout(LIMIT)
    theirs.settimeout(LIMIT)
    reading, writing = theirs.makefile("rb"), theirs.makefile("wb")
    adapter = Adapter(Channel(reading, writing))
    thread = threading.Thread(target=adapter.serve, daemon=True)
    thread.start()
    editor = Editor(CheckedStream.from_socket(ours, "adapter"))
    yield editor
    editor.ask("disconnect")
    thread.join(LIMIT)
    assert not thread.is_alive()
    editor.channel.close()
    for one in (reading, writing, ours, theirs):
        one.close()


@pytest.fixture
def editor_of():
    """Makes an editor on a reading and a writing stream."""
    return lambda reading, writing: Editor(CheckedStream(reading, writing, "adapter"))
