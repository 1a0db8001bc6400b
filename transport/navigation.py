"""A goal for the robot's own navigation: a client of the ROS 2 action ``nav2_msgs/NavigateToPose``.

An action is made of services and topics below ``NAME/_action/``: a goal with a number of its own is sent by
``send_goal``, ``get_result`` answers when it has ended, ``cancel_goal`` gives it up (design.ros2.org, *Actions*).
rmw_zenoh lays them out like any others. The types' hashes differ between distributions, so the keys are not made up but
read from the liveliness tokens of who serves them. Of a result only the status is read, which every distribution has in
its first byte. The topic ``feedback`` says how far the robot has to go. The topic ``status`` says how each goal has
ended, which counts where the result is lost.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable
from dataclasses import replace
from math import cos, isfinite, sin
from threading import Event, Lock, Thread
from typing import Any, NamedTuple

import numpy as np
from rosbags.typesys import get_types_from_msg

from transport import codec
from transport.bus import Bus, Newest
from transport.keys import RobotKeys
from transport.messages import Navigation, Pose
from transport.ros_graph import RosGraph, RosSender
from transport.ros_tokens import topic_token

SERVICES = ("send_goal", "get_result", "cancel_goal")
FEEDBACK, STATUS = "feedback", "status"
SURVEY = 0.3
"""How long the search for servers of an action takes, s."""
SHORT = 2.0
"""Timeout for the answer to a goal, or to its cancellation, s."""
LONG = 5.0
"""How long one question for the result waits, s; then it is asked again."""
GONE = 0.05
"""An answer that fails to come sooner than this says that nobody is there to give it, s."""

_ENDED = {4: "", 5: "it was given up", 6: "it could not reach the goal"}
"""The statuses of ``action_msgs/GoalStatus`` with which a goal ends, and why that is a failure."""
_STATUS = 4
"""Where the first byte of a message is, behind the header of its encoding."""

_NUMBER_BYTES = slice(4, 20)
"""Where the number of the goal is in a message that begins with it."""

_SEND_GOAL, _NUMBER, _CANCEL, _FEEDBACK, _STATUSES = (
    "nav2_msgs/msg/NavigateToPose_SendGoal_Request",
    "nav2_msgs/msg/NavigateToPose_GetResult_Request",
    "action_msgs/msg/CancelGoal_Request",
    "nav2_msgs/msg/NavigateToPose_FeedbackMessage",
    "action_msgs/msg/GoalStatusArray",
)
codec.TYPES.register(
    get_types_from_msg(
        "unique_identifier_msgs/UUID goal_id\ngeometry_msgs/PoseStamped pose\nstring behavior_tree", _SEND_GOAL
    )
    | get_types_from_msg("unique_identifier_msgs/UUID goal_id", _NUMBER)
    | get_types_from_msg("action_msgs/GoalInfo goal_info", _CANCEL)
    | get_types_from_msg(
        "unique_identifier_msgs/UUID goal_id\ngeometry_msgs/PoseStamped current_pose\n"
        "builtin_interfaces/Duration navigation_time\nbuiltin_interfaces/Duration estimated_time_remaining\n"
        "int16 number_of_recoveries\nfloat32 distance_remaining",
        _FEEDBACK,
    )
)


class Service(NamedTuple):
    """A service of an action: where it is asked, and what rides with a question."""

    key: str
    attachment: Callable[[], bytes]


class Navigator:
    """Has the robot's own navigation reach one goal at a time, from a thread for each: the loop is never held up.

    Args:
        bus: where the action is served.
        keys: the robot's.
        graph: this node in the ROS graph, with the keys of rmw_zenoh.
    """

    def __init__(self, bus: Bus, keys: RobotKeys, graph: RosGraph | None) -> None:
        self._bus, self._keys, self._graph = bus, keys, graph
        self._services: dict[str, Service] = {}
        self._topics: dict[str, Newest] = {}
        self._pursuit: _Pursuit | None = None

    def pursue(self, goal: Pose | None) -> None:
        """Drive to a goal, or continue; without a goal, or with another one, the last one is cancelled. Never waits."""
        if self._pursuit is not None and self._pursuit.goal == goal:
            return
        if self._pursuit is not None:
            self._pursuit.give_up()
            self._pursuit = None
        if goal is not None:
            self._pursuit = _Pursuit(self._bus, self._found, goal, self._keys.settings.navigation_frame)
            self._pursuit.start()

    def news(self) -> Navigation | None:
        """How it does with the goal, by its answers and its topics; None without one."""
        if self._pursuit is None:
            return None
        for name, hear in ((FEEDBACK, self._pursuit.hear_feedback), (STATUS, self._pursuit.hear_status)):
            message = self._topics[name].take() if name in self._topics else None
            if message is not None:
                hear(message.payload)
        return self._pursuit.news

    def close(self) -> None:
        """Cancel the goal, and make sure that the request arrives."""
        if self._pursuit is not None:
            self._pursuit.give_up()
            self._pursuit.join(SHORT)
            self._pursuit = None

    def _found(self) -> dict[str, Service]:
        """The action's services, and its topics; empty without a server."""
        if not self._services:
            keys = {one: f"{self._keys.navigation}/_action/{one}" for one in (*SERVICES, FEEDBACK, STATUS)}
            if self._graph is not None:
                offered = _offered(self._bus.survey(SURVEY), self._keys.settings.domain)
                keys = {one: offered[key] for one, key in keys.items() if key in offered}
            if keys.keys() >= set(SERVICES):
                for one in keys.keys() & {FEEDBACK, STATUS}:
                    self._listen(one, keys[one])
                self._services = {one: self._service(self._graph, keys[one]) for one in SERVICES}
        return self._services

    def _listen(self, name: str, key: str) -> None:
        self._topics[name] = self._bus.newest(key)
        if self._graph is not None:
            self._graph.subscriber(key)

    @staticmethod
    def _service(graph: RosGraph | None, key: str) -> Service:
        return Service(key, bytes if graph is None else RosSender(graph.client(key)).attachment)


class _Pursuit(Thread):
    """One goal, from being sent to its end.

    Attributes:
        goal: the pose.
        news: how it does; replaced, never changed.
    """

    def __init__(self, bus: Bus, find: Callable[[], dict[str, Service]], goal: Pose, frame: str) -> None:
        super().__init__(name="navigation", daemon=True)
        self.goal = goal
        self.news = Navigation(goal)
        self._bus, self._find, self._frame = bus, find, frame
        number = np.frombuffer(secrets.token_bytes(16), np.uint8)
        self._number = codec.MESSAGES["unique_identifier_msgs/msg/UUID"](uuid=number)
        self._given_up = Event()
        self._changing = Lock()

    def give_up(self) -> None:
        """Have the goal cancelled; never waits."""
        self._given_up.set()

    def hear_feedback(self, payload: bytes) -> None:
        """What a message of the topic ``feedback`` says, where it is of this goal and can be read."""
        if payload[_NUMBER_BYTES] != bytes(self._number.uuid):
            return
        try:
            said = codec.decode_message(payload, _FEEDBACK)
        except codec.CodecError:
            return
        left = float(said.distance_remaining)
        with self._changing:
            self.news = replace(
                self.news,
                distance=left if isfinite(left) and left >= 0 else None,
                recoveries=max(0, int(said.number_of_recoveries)),
            )

    def hear_status(self, payload: bytes) -> None:
        """What a message of the topic ``status`` says, which lists all goals of the server."""
        try:
            said = codec.decode_message(payload, _STATUSES)
        except codec.CodecError:
            return
        for one in said.status_list:
            if bytes(one.goal_info.goal_id.uuid) == bytes(self._number.uuid):
                self._end(int(one.status))

    def run(self) -> None:
        """Send the goal, and watch it until it has ended or is cancelled."""
        services = self._find()
        if not services:
            self._tell("missing", "there is no server for the action on the network")
            return
        answer = self._ask(services["send_goal"], self._request(), _SEND_GOAL, SHORT)
        if answer is None:
            self._tell("missing", "the navigation does not answer")
        elif not answer[_STATUS]:
            self._tell("failed", "the navigation refuses the goal")
        else:
            self._tell("driving")
            watch = Thread(target=self._watch, args=(services["get_result"],), name="navigation result", daemon=True)
            watch.start()
            while watch.is_alive() and not self._given_up.wait(GONE):
                pass
            if self._given_up.is_set() and self.news.state == "driving":
                stamp = codec.time_of(0)
                info = codec.MESSAGES["action_msgs/msg/GoalInfo"](goal_id=self._number, stamp=stamp)
                self._ask(services["cancel_goal"], codec.MESSAGES[_CANCEL](goal_info=info), _CANCEL, SHORT)

    def _watch(self, service: Service) -> None:
        """Wait for the result, until the goal is cancelled."""
        while self.news.state == "driving" and not self._given_up.is_set():
            asked = time.monotonic()
            answer = self._ask(service, codec.MESSAGES[_NUMBER](goal_id=self._number), _NUMBER, LONG)
            if answer is not None and self._end(answer[_STATUS]):
                return
            if answer is not None or time.monotonic() - asked < GONE:
                self._tell("failed", "the navigation is gone")
                return

    def _ask(self, service: Service, request: object, kind: str, limit: float) -> bytes | None:
        payload = codec.encode_message(request, kind)
        answer = self._bus.ask(service.key, payload, limit, service.attachment())
        return answer if answer is not None and len(answer) > _STATUS else None

    def _request(self) -> Any:
        make, goal = codec.MESSAGES, self.goal
        pose = make["geometry_msgs/msg/Pose"](
            position=make["geometry_msgs/msg/Point"](x=goal.x, y=goal.y, z=0.0),
            orientation=make["geometry_msgs/msg/Quaternion"](
                x=0.0, y=0.0, z=sin(goal.heading / 2), w=cos(goal.heading / 2)
            ),
        )
        stamped = make["geometry_msgs/msg/PoseStamped"](header=codec.header(0, self._frame), pose=pose)
        return make[_SEND_GOAL](goal_id=self._number, pose=stamped, behavior_tree="")

    def _end(self, status: int) -> bool:
        """Whether the goal has ended by a status; the result and the topic ``status`` may both say so."""
        if status not in _ENDED:
            return False
        self._tell("failed" if _ENDED[status] else "arrived", _ENDED[status])
        return True

    def _tell(self, state: Any, reason: str = "") -> None:
        with self._changing:
            # What has ended stays as it ended.
            if self.news.state in ("asked", "driving"):
                self.news = replace(self.news, state=state, reason=reason)


def _offered(heard: set[str], domain: int) -> dict[str, str]:
    """The keys of the services and topics that liveliness tokens show, by their names without the leading slash."""
    found = {}
    for token in map(topic_token, heard):
        if token is not None and token.domain == domain and token.kind in ("SS", "MP"):
            found[token.path] = f"{domain}/{token.path}/{token.dds_type}/{token.type_hash}"
    return found
