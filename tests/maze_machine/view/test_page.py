"""The page of a run, by itself and live."""

import http.client
import json
import shutil
import subprocess
from urllib.parse import urlsplit

import numpy as np
import pytest

from maze_machine.view.live import Feed, LivePage
from maze_machine.view.page import STRIDE, frame, head, live_page, replay_page
from transport.description import RobotDescription
from transport.messages import Command, Observation, Odometry, Pose, Scan, Twist

ROBOT = RobotDescription()
LIMIT = 20

# Just enough of a browser to run the page's script: elements that remember, a pen that draws nowhere.
BROWSER = """
class Element {
  constructor() { this.children = []; this.classList = { toggle() {} }; this.clientWidth = 800; this.clientHeight = 600;
                  this.value = "10"; }
  append(child) { this.children.push(child); }
  prepend(child) { this.children.unshift(child); }
  getContext() { return new Proxy({}, { get: () => () => undefined, set: () => true }); }
}
const elements = {};
const document = { getElementById: (id) => elements[id] ??= new Element(), createElement: () => new Element() };
const window = {};
const beats = [];
const requestAnimationFrame = (beat) => beats.push(beat);
class EventSource { constructor(path) { EventSource.only = this; this.path = path; } addEventListener() {} }
"""


def ticks(count):
    for index in range(count):
        stamp = 100_000_000 * index
        ranges = np.full(ROBOT.laser.beams, np.inf, dtype=np.float32)
        ranges[:STRIDE] = 1.234
        observation = Observation(
            stamp, Scan(stamp, ROBOT.laser.geometry(), ranges), Odometry.at(stamp, Pose(index, 2.0, 0.5))
        )
        step = {"states": ["run", f"state_{index % 3}"], "taken": [f"<b>{index}</b> -> </script>"] if index % 2 else []}
        yield observation, Command(Twist(0.5)), step


def frames(count):
    return [frame(*tick) for tick in ticks(count)]


def run_script(page, then):
    """What the page's script says when it is run, with something done afterwards."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("no JavaScript interpreter here")
    script = page.partition("<script>")[2].partition("</script>")[0]
    ended = subprocess.run(
        [node, "-e", BROWSER + script + then], capture_output=True, text=True, timeout=LIMIT, check=False
    )
    assert ended.returncode == 0, ended.stderr
    return json.loads(ended.stdout)


def test_a_frame_says_where_the_robot_was_what_it_did_and_what_it_saw():
    observation, command, step = next(ticks(1))
    shown = frame(observation, command, step)
    assert (shown["time"], shown["pose"], shown["twist"]) == (0.0, [0.0, 2.0, 0.5], [0.5, 0.0, 0.0])
    assert shown["states"] == step["states"]
    assert shown["ranges"] == [123] + [-1] * (ROBOT.laser.beams // STRIDE - 1)
    assert frame(observation, command, step, Pose(7, 8, 9))["pose"] == [7, 8, 9]


def test_a_page_needs_nothing_else_and_survives_any_text():
    page = replay_page(head("<one> & </script>", ROBOT), frames(4))
    assert page.count("</script>") == 1
    assert "http" not in page
    assert "/*DATA*/" not in page


def test_the_script_shows_all_states_and_transitions_and_plays():
    page = replay_page(head("a run", ROBOT, {"walls": [[0, 0, 4, 0]], "doors": [], "exits": []}), frames(30))
    told = run_script(
        page,
        """
        for (let k = 0; k < 20 && beats.length; k += 1) beats.shift()(performance.now() + 100 * k);
        const states = elements.states.children.map((one) => one.textContent), taken = elements.taken.children.length;
        console.log(JSON.stringify({ title: document.title, states, taken, at, now: elements.now.textContent }));
        """,
    )
    assert told["title"] == "a run"
    assert told["states"] == ["run", "state_0", "state_1", "state_2"]
    assert told["taken"] == 15
    assert told["at"] > 0, "it plays by itself"
    assert " s " in told["now"]


def test_the_script_follows_live_frames():
    added = json.dumps(frames(3))
    told = run_script(
        live_page(head("live", ROBOT)),
        f"""
        for (const one of {added}) EventSource.only.onmessage({{ data: JSON.stringify(one) }});
        beats.shift()(performance.now());
        console.log(JSON.stringify({{ path: EventSource.only.path, at, known: frames.length }}));
        """,
    )
    assert told == {"path": "frames", "at": 2, "known": 3}


def get(address, path):
    connection = http.client.HTTPConnection(urlsplit(address).netloc, timeout=LIMIT)
    connection.request("GET", path)
    return connection.getresponse()


def test_a_live_page_streams_every_frame_in_order_also_to_those_who_come_late():
    wanted = frames(5)
    with LivePage(head("live", ROBOT)) as page:
        for one in wanted[:3]:
            page.publish(one)
        stream = get(page.address, "/frames")
        assert stream.getheader("Content-Type") == "text/event-stream"
        assert b"EventSource" in get(page.address, "/").read()
        assert get(page.address, "/etc/passwd").status == 404
        for one in wanted[3:]:
            page.publish(one)
        lines = (stream.readline() for _ in range(1000))
        data = (json.loads(line[6:]) for line in lines if line.startswith(b"data: "))
        assert [next(data) for _ in wanted] == wanted
    assert b"event: end" in stream.read(), "the end of the run is told"
    with pytest.raises(OSError, match="refused"):
        get(page.address, "/")


def test_a_reader_that_left_does_not_hold_up_the_run():
    with LivePage(head("live", ROBOT)) as page:
        page.publish(frames(1)[0])
        get(page.address, "/frames").close()
        for one in frames(200):
            page.publish(one)


def test_a_feed_keeps_the_newest(monkeypatch):
    monkeypatch.setattr("maze_machine.view.live.KEPT", 10)
    feed = Feed()
    for index in range(35):
        feed.publish({"index": index})
    kept, after, more = feed.after(0, 0.0)
    assert (after, more) == (35, True)
    assert [json.loads(one)["index"] for one in kept] == list(range(35 - len(kept), 35))
    assert 10 <= len(kept) <= 20
    assert feed.after(34, 0.0)[0] == kept[-1:]
    feed.close()
    assert feed.after(35, 5.0) == ([], 35, False)
