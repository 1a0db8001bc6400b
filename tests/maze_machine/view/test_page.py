"""The page of a run: what is in it, and its server."""

import http.client
import json
from collections.abc import Mapping
from contextlib import contextmanager
from functools import partial
from typing import NamedTuple
from urllib.parse import parse_qs, urlsplit

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from maze_machine.view.drawings import cleaned
from maze_machine.view.live import Feed, LivePage, SimulatedTime
from maze_machine.view.page import KEYFRAME, FrameEncoder, head, live_page, replay_page
from transport.description import RobotDescription

ROBOT = RobotDescription()
LIMIT = 20


def frames(count):
    for index in range(count):
        frame = {"tick": index, "stamp": 10**8 * index, "pose": [index, 0.0, 0.0], "states": ["a", f"b{index // 7}"]}
        yield {**frame, "events": [f"go{index}"]} if index % 5 == 0 else frame


def complete(lines):
    """What the page makes of encoded frames."""
    before, found = {}, []
    for line in lines:
        said = json.loads(line)
        gone = said.pop("gone", ())
        before = {**({} if said.pop("whole", False) else before), **said}
        for name in gone:
            del before[name]
        found.append(before)
    return found


def test_what_is_left_out_of_a_frame_can_be_put_back_from_any_whole_one():
    lines = list(map(FrameEncoder(), frames(3 * KEYFRAME)))
    assert complete(lines) == list(frames(3 * KEYFRAME))
    assert complete(lines[KEYFRAME:]) == list(frames(3 * KEYFRAME))[KEYFRAME:]
    assert b'"states"' not in lines[1], "what is as before is left out"


def test_a_page_needs_nothing_else_and_survives_any_text():
    page = replay_page(head("</script><!--<script>", ROBOT), frames(4), {"line": "</script>"})
    assert page.count("</script>") == 3
    assert "<!--" not in page.partition("</head>")[2]
    assert "/*" + "DATA*/" not in page
    assert "src=" not in page.replace("data:,", "").partition("<script>")[0]


def test_a_page_without_data_is_smaller_than_400_kb():
    assert len(live_page(head("", ROBOT), "").encode()) < 400_000


@pytest.mark.parametrize(
    "drawing",
    [
        '<svg xmlns="http://www.w3.org/2000/svg" onload="alert(1)"><script>alert(1)</script></svg>',
        '<svg xmlns="http://www.w3.org/2000/svg"><g><a href="javascript:alert(1)"><text>x</text></a></g></svg>',
        '<svg xmlns="http://www.w3.org/2000/svg"><image href="http://elsewhere/"/><text onclick="x">y</text></svg>',
        '<svg xmlns="http://www.w3.org/2000/svg"><g class="a&quot; onload=&quot;b"/></svg>',
    ],
)
def test_of_a_picture_of_somebody_elses_only_shapes_are_left(drawing):
    kept = cleaned(drawing)
    assert kept.startswith("<svg")
    assert not any(word in kept for word in ("script", "alert", "href", "onload", "onclick", "image"))


@pytest.mark.parametrize("drawing", ["", "no picture", "<html/>", "<svg"])
def test_what_is_no_picture_is_none(drawing):
    assert cleaned(drawing) in ("", "<svg />")


@contextmanager
def served(**what):
    with LivePage(head("live", ROBOT), **what) as page:
        yield page, urlsplit(page.address)


class Got(NamedTuple):
    """What was answered."""

    status: int
    body: bytes
    headers: Mapping[str, str]


def get(address, path, **headers):
    connection = http.client.HTTPConnection(address.netloc, timeout=LIMIT)
    try:
        connection.request("GET", path, headers=headers)
        answer = connection.getresponse()
        return Got(answer.status, answer.read(), dict(answer.getheaders()))
    finally:
        connection.close()


def socket_of(page, **options):
    return connect(page.address.replace("http", "ws").replace("/?", "/frames?"), open_timeout=LIMIT, **options)


def received(browser, count):
    found = []
    while len(found) < count:
        said = json.loads(browser.recv(timeout=LIMIT))
        found += [json.dumps(one) for one in said.get("frames", ())]
    return complete(found)


def test_every_frame_comes_in_order_also_to_those_who_come_late_and_then_the_end():
    wanted = list(frames(5))
    with served() as (page, _):
        for one in wanted[:3]:
            page.publish(partial(dict, one))
        with socket_of(page) as early:
            assert received(early, 3) == wanted[:3]
            for one in wanted[3:]:
                page.publish(partial(dict, one))
            with socket_of(page) as late:
                assert received(late, 5) == wanted
                page.end({"line": "over", "at_rest": True})
                assert json.loads(late.recv(timeout=LIMIT)) == {"end": {"line": "over", "at_rest": True}}


def test_an_operators_questions_are_answered():
    asked = []

    def operate(question):
        asked.append(question)
        return b'{"done":true}'

    with served(operate=operate, simulation=lambda: SimulatedTime(pausable=True)) as (page, _):
        with socket_of(page) as browser:
            assert json.loads(browser.recv(timeout=LIMIT)) == {"simulation": {"pausable": True, "paused": ""}}
            browser.send('{"kind":"end"}')
            assert json.loads(browser.recv(timeout=LIMIT)) == {"answer": {"done": True}}
        assert asked == [b'{"kind":"end"}']


def test_a_page_that_only_shows_refuses():
    with served() as (page, _), socket_of(page) as browser:
        browser.send('{"kind":"end"}')
        assert json.loads(browser.recv(timeout=LIMIT))["answer"]["done"] is False


def test_a_question_that_is_too_long_ends_the_connection():
    with served(operate=lambda _: b"{}") as (page, _), socket_of(page) as browser:
        browser.send("x" * 100_000)
        with pytest.raises(ConnectionClosed):
            browser.recv(timeout=LIMIT)


@pytest.mark.parametrize(
    "headers",
    [{"Host": "evil.example"}, {"Host": "evil.example:80"}, {"Origin": "http://evil.example"}, {"Origin": "null"}],
)
def test_other_hosts_and_other_pages_are_refused(headers):
    with served() as (_, address):
        path = f"/?{address.query}"
        assert get(address, path, **headers).status == 403
        assert get(address, path).status == 200
        asked = f"/frames?{address.query}"
        upgrade = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13"}
        answer = get(address, asked, **upgrade, **{"Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}, **headers)
        assert answer.status == 403


@pytest.mark.parametrize("path", ["/", "/?token=", "/?token=guess", "/drawing?state=a", "/frames"])
def test_without_the_token_nothing_is_shown(path):
    with served(drawn=lambda _: "<svg/>") as (_, address):
        assert get(address, path).status == 403


def test_the_page_says_what_it_may_load():
    with served() as (_, address):
        answer = get(address, f"/?{address.query}")
        policy = {name.lower(): value for name, value in answer.headers.items()}["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "frame-ancestors 'none'" in policy


def test_a_machine_is_drawn_when_it_is_asked_for():
    with served(drawn={"": "<svg>all</svg>", "a b": "<svg>one</svg>"}.__getitem__) as (_, address):
        assert get(address, f"/drawing?state=a%20b&{address.query}").body == b"<svg>one</svg>"
        assert get(address, f"/drawing?state=c&{address.query}").status == 404


def test_only_the_loopback_is_listened_on():
    with served() as (_, address):
        assert address.hostname == "127.0.0.1"
        assert len(parse_qs(address.query)["token"][0]) >= 16


def test_a_reader_that_left_does_not_hold_up_the_run():
    with served() as (page, _):
        with socket_of(page):
            pass
        for one in frames(200):
            page.publish(partial(dict, one))
        with socket_of(page) as browser:
            assert len(received(browser, 200)) == 200


def test_a_feed_keeps_the_newest(monkeypatch):
    monkeypatch.setattr("maze_machine.view.live.KEPT", KEYFRAME)
    feed, wanted = Feed(), list(frames(5 * KEYFRAME))
    for one in wanted:
        feed.publish(partial(dict, one))
        feed.encode()
    kept, after = feed.after(0)
    assert after == len(wanted)
    assert KEYFRAME <= len(kept) <= 2 * KEYFRAME
    assert complete(kept) == wanted[-len(kept) :]
    assert feed.after(after) == ([], after)
