"""ROS 2 as other people's programs have it: an SDK by a robot maker, over rmw_zenoh's keys, as client and as robot."""

from __future__ import annotations

import re
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import ClassVar

import numpy as np
import pytest
from programs import LIMIT, command
from toy_world import GEOMETRY

from perception import Perception
from perception.signals import navigation_distance
from skills.activities.navigate_to_pose import NavigateToPose
from transport import codec
from transport.connect import dialling, open_robot, routing
from transport.description import RobotDescription
from transport.messages import STOP, Command, Twist
from transport.robot import LinkError
from transport.settings import LinkSettings

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    sdk = pytest.importorskip("zenoh_ros2_sdk", reason="needs zenoh-ros2-sdk")
    from zenoh_ros2_sdk import discovery, message_registry
    from zenoh_ros2_sdk.session import ZenohSession

KINDS = (
    codec.LASER_SCAN,
    codec.ODOMETRY,
    codec.TWIST,
    codec.TWIST_STAMPED,
    "geometry_msgs/msg/PoseStamped",
    "unique_identifier_msgs/msg/UUID",
    "builtin_interfaces/msg/Duration",
    "action_msgs/msg/GoalStatusArray",
)
NAMELESS = RobotDescription(name="toy", namespace="")


def until(there: Callable[[], object], limit: float = LIMIT) -> object:
    """What is there at last."""
    deadline = time.monotonic() + limit
    while not (found := there()):
        assert time.monotonic() < deadline, "waited too long"
        time.sleep(0.01)
    return found


@pytest.fixture(scope="module", autouse=True)
def definitions(tmp_path_factory: pytest.TempPathFactory) -> None:
    """The SDK would fetch the message definitions from their repositories; here they come from rosbags."""
    folder = tmp_path_factory.mktemp("messages")
    for kind in KINDS:
        text, _ = codec.TYPES.generate_msgdef(kind, ros_version=2)
        for part in re.split(r"^=+\nMSG: ", f"MSG: {kind}\n{text}".removeprefix("MSG: "), flags=re.MULTILINE):
            name, _, body = part.partition("\n")
            package, short = name.strip().split("/")[0], name.strip().split("/")[-1]
            (folder / package / "msg").mkdir(parents=True, exist_ok=True)
            (folder / package / "msg" / f"{short}.msg").write_text(body)
    message_registry.get_registry().messages_dir = folder


@pytest.fixture
def place(endpoint: str) -> Iterator[dict[str, object]]:
    """Where the SDK finds its network; its one session is closed at the end."""
    message_registry.get_registry()._loaded_types.clear()
    yield {"router_ip": "127.0.0.1", "router_port": int(endpoint.rpartition(":")[2])}
    if ZenohSession._instance is not None:
        ZenohSession._instance.close()


def simulator(endpoint: str, *settings: str) -> object:
    given = ["link.keys=rmw_zenoh", *settings]
    return command("sim", "corridor", "--listen", endpoint, *(f"--set={one}" for one in given))


@pytest.mark.parametrize("stamped", [False, True], ids=["Twist", "TwistStamped"])
def test_the_sdk_lists_our_topics_sees_the_simulated_robot_and_drives_it(
    endpoint: str, place: dict[str, object], *, stamped: bool
) -> None:
    kind = codec.TWIST_STAMPED if stamped else codec.TWIST
    settings = ["robot.namespace=", f"link.command_type={kind.rpartition('/')[2]}"]
    with simulator(endpoint, *settings) as robot:
        assert endpoint in robot.line()
        listed = until(lambda: dict(discovery.get_topic_names_and_types(**place)))
        assert listed == {
            "/scan": [codec.LASER_SCAN],
            "/odom": [codec.ODOMETRY],
            "/clock": [codec.CLOCK],
            "/cmd_vel": [kind],
        }
        assert discovery.get_service_names_and_types(**place) == [("/open_door", ["std_srvs/srv/Trigger"])]
        scans, odometries = [], []
        sdk.ROS2Subscriber("/scan", codec.LASER_SCAN, scans.append, **place)
        sdk.ROS2Subscriber("/odom", codec.ODOMETRY, odometries.append, **place)
        publisher = sdk.ROS2Publisher("/cmd_vel", kind, **place)
        types = ZenohSession.get_instance().store.types
        vector = types["geometry_msgs/msg/Vector3"]
        velocity = {"linear": vector(x=0.3, y=0.0, z=0.0), "angular": vector(x=0.0, y=0.0, z=0.0)}
        if stamped:
            header = types["std_msgs/msg/Header"](
                stamp=types["builtin_interfaces/msg/Time"](sec=0, nanosec=0), frame_id="base_link"
            )
            velocity = {"header": header, "twist": types["geometry_msgs/msg/Twist"](**velocity)}
        until(lambda: scans and odometries)
        began = odometries[0].pose.pose.position

        def driven() -> bool:
            publisher.publish(**velocity)
            now = odometries[-1].pose.pose.position
            return bool(np.hypot(now.x - began.x, now.y - began.y) > 0.1)

        until(driven)
        assert len(scans[-1].ranges) == 1000
        assert scans[-1].header.frame_id == "laser"
        assert odometries[-1].header.frame_id == "odom"
        # Nobody commands any more: the robot stops by itself.
        until(lambda: abs(odometries[-1].twist.twist.linear.x) < 0.01)


def test_the_sdk_rings_at_the_door_of_the_simulated_robot(endpoint: str, place: dict[str, object]) -> None:
    with simulator(endpoint, "robot.namespace=") as robot:
        assert endpoint in robot.line()
        # The SDK reads no service file whose request is empty, so it is given the two parts, and the hash of both.
        parts = {"request_definition": "", "response_definition": "bool success\nstring message\n"}
        type_hash = codec.type_hash(codec.TRIGGER)
        client = sdk.ROS2ServiceClient("/open_door", codec.TRIGGER, type_hash=type_hash, timeout=20.0, **parts, **place)
        until(lambda: discovery.get_service_names_and_types(**place))
        answer = client.call()
        assert (answer.success, answer.message) == (False, "the maze has no door")


class Robot(threading.Thread):
    """A robot of the SDK's: it publishes what it senses and obeys; ten times a second until it is told to end."""

    def __init__(self, place: dict[str, object], kind: str = codec.TWIST) -> None:
        super().__init__(daemon=True)
        self.told: list[float] = []
        self.over = threading.Event()
        self._scan = sdk.ROS2Publisher("/scan", codec.LASER_SCAN, **place)
        self._odometry = sdk.ROS2Publisher("/odom", codec.ODOMETRY, **place)
        sdk.ROS2Subscriber("/cmd_vel", kind, self._obey, **place)
        self._types = ZenohSession.get_instance().store.types

    def _obey(self, message: object) -> None:
        twist = getattr(message, "twist", message)
        self.told.append(twist.linear.x)

    def _at(self, stamp: int, frame: str) -> object:
        time_ = self._types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
        return self._types["std_msgs/msg/Header"](stamp=time_, frame_id=frame)

    def run(self) -> None:
        types = self._types
        zero = types["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
        pose = types["geometry_msgs/msg/Pose"](
            position=types["geometry_msgs/msg/Point"](x=0.0, y=0.0, z=0.0),
            orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
        )
        still = types["geometry_msgs/msg/Twist"](linear=zero, angular=zero)
        nothing = np.zeros(36)
        while not self.over.wait(0.1):
            stamp = time.time_ns()
            self._odometry.publish(
                header=self._at(stamp, "odom"),
                child_frame_id="base_footprint",
                pose=types["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=nothing),
                twist=types["geometry_msgs/msg/TwistWithCovariance"](twist=still, covariance=nothing),
            )
            self._scan.publish(
                header=self._at(stamp, "base_scan"),
                angle_min=GEOMETRY.angle_min,
                angle_max=GEOMETRY.angle_max,
                angle_increment=GEOMETRY.angle_increment,
                time_increment=0.0,
                scan_time=0.1,
                range_min=GEOMETRY.range_min,
                range_max=GEOMETRY.range_max,
                ranges=np.full(GEOMETRY.beams, 2.0, np.float32),
                intensities=np.zeros(GEOMETRY.beams, np.float32),
            )


@pytest.mark.parametrize("command_type", ["Twist", "TwistStamped"])
def test_a_robot_of_the_sdk_is_driven_by_us(endpoint: str, place: dict[str, object], command_type: str) -> None:
    with routing(endpoint):
        robot = Robot(place, f"geometry_msgs/msg/{command_type}")
        robot.start()
        try:
            with dialling(endpoint) as bus:
                settings = LinkSettings(keys="rmw_zenoh", command_type=command_type, connect=20.0)
                controlled = open_robot(bus, NAMELESS, settings)
                observation = controlled.observe()
                assert observation.scan.ranges[0] == 2.0
                assert observation.odometry.pose.heading == 0.0

                def driven() -> bool:
                    controlled.command(Command(Twist(0.2), answers=controlled.observe().stamp))
                    return 0.2 in robot.told

                until(driven)
                controlled.close()
                until(lambda: robot.told[-1] == STOP.forward)
        finally:
            robot.over.set()
            robot.join(LIMIT)


class SdkNavigation:
    """A navigation of the SDK's: the three services of the action, whose results wait until it is told to give them."""

    GOAL_ID = "unique_identifier_msgs/UUID goal_id\n"
    PARTS: ClassVar[dict[str, tuple[str, str, str]]] = {
        "send_goal": (
            "nav2_msgs/action/NavigateToPose_SendGoal",
            f"{GOAL_ID}geometry_msgs/PoseStamped pose\nstring behavior_tree\n",
            "bool accepted\nbuiltin_interfaces/Time stamp\n",
        ),
        "get_result": (
            "nav2_msgs/action/NavigateToPose_GetResult",
            GOAL_ID,
            "int8 status\nuint16 error_code\nstring error_msg\n",
        ),
        "cancel_goal": (
            "action_msgs/srv/CancelGoal",
            f"{GOAL_ID}builtin_interfaces/Time stamp\n",
            "int8 return_code\nuint32 none\n",
        ),
    }

    def __init__(self, place: dict[str, object]) -> None:
        for kind in (
            "unique_identifier_msgs/msg/UUID",
            "geometry_msgs/msg/PoseStamped",
            "builtin_interfaces/msg/Duration",
        ):
            ZenohSession.get_instance(**place).register_message_type(None, kind)
        # An action's topics; the SDK knows no actions, so each is a topic whose type it reads from the text given.
        self.feedback = sdk.ROS2Publisher(
            "/navigate_to_pose/_action/feedback",
            "nav2_msgs/msg/NavigateToPose_FeedbackMessage",
            msg_definition=f"{self.GOAL_ID}geometry_msgs/PoseStamped current_pose\n"
            "builtin_interfaces/Duration navigation_time\nbuiltin_interfaces/Duration estimated_time_remaining\n"
            "int16 number_of_recoveries\nfloat32 distance_remaining\n",
            type_hash=f"RIHS01_{7:064x}",
            **place,
        )
        self.status = sdk.ROS2Publisher(
            "/navigate_to_pose/_action/status",
            "action_msgs/msg/GoalStatusArray",
            type_hash=f"RIHS01_{8:064x}",
            **place,
        )
        self.servers = {}
        for at, (name, (kind, request, response)) in enumerate(self.PARTS.items()):
            self.servers[name] = sdk.ROS2ServiceServer(
                f"/navigate_to_pose/_action/{name}",
                kind,
                request_definition=request,
                response_definition=response,
                type_hash=f"RIHS01_{at:064x}",  # of whatever distribution: it is read, not made up
                mode="queue",
                **place,
            )

    def publish_feedback(self, goal: object, distance: float) -> None:
        """How far it is to the goal."""
        make = codec.MESSAGES
        span = make["builtin_interfaces/msg/Duration"](sec=1, nanosec=0)
        pose = make["geometry_msgs/msg/PoseStamped"](
            header=codec.header(0, "map"),
            pose=make["geometry_msgs/msg/Pose"](
                position=make["geometry_msgs/msg/Point"](x=0.0, y=0.0, z=0.0),
                orientation=make["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
            ),
        )
        self.feedback.publish(
            goal_id=goal,
            current_pose=pose,
            navigation_time=span,
            estimated_time_remaining=span,
            number_of_recoveries=1,
            distance_remaining=distance,
        )

    def publish_status(self, goal: object, status: int) -> None:
        """The list of goals: this one, with a status."""
        make = codec.MESSAGES
        info = make["action_msgs/msg/GoalInfo"](goal_id=goal, stamp=codec.time_of(0))
        self.status.publish(status_list=[make["action_msgs/msg/GoalStatus"](goal_info=info, status=status)])

    def take(self, name: str) -> tuple[object, object]:
        return self.servers[name].take_request(timeout=LIMIT)

    def answer(self, name: str, key: object, **fields: object) -> None:
        self.servers[name].send_response(key, self.servers[name].response_msg_class(**fields))


def test_a_navigation_of_the_sdk_is_given_goals_by_a_machine_s_activity(
    endpoint: str, place: dict[str, object]
) -> None:
    with routing(endpoint):
        robot, navigation = Robot(place), SdkNavigation(place)
        robot.start()
        try:
            with dialling(endpoint) as bus:
                controlled = open_robot(bus, NAMELESS, LinkSettings(keys="rmw_zenoh", connect=20.0))
                activity = NavigateToPose(1.5, -0.5)
                perception = Perception(NAMELESS)

                def tick() -> str | None:
                    effect = activity.tick(perception.facts(controlled.observe()))
                    controlled.command(effect if isinstance(effect, Command) else Command())
                    return None if isinstance(effect, Command) else effect.name

                with ThreadPoolExecutor() as beside:

                    def under_way() -> tuple[object, object]:
                        """The goal that is asked for and accepted, and the question for its result."""
                        goal = beside.submit(navigation.take, "send_goal")
                        until(lambda: tick() is None and goal.done())
                        key, asked = goal.result()
                        navigation.answer("send_goal", key, accepted=True, stamp=codec.time_of(0))
                        result = beside.submit(navigation.take, "get_result")
                        until(lambda: tick() is None and result.done())
                        key, waiting = result.result()
                        assert bytes(waiting.goal_id.uuid) == bytes(asked.goal_id.uuid)
                        return asked, key

                    asked, key = under_way()
                    assert (asked.pose.header.frame_id, asked.pose.pose.position.x) == ("map", 1.5)
                    driven = len(robot.told)

                    def sees(distance: float) -> bool:
                        navigation.publish_feedback(asked.goal_id, distance)
                        assert tick() is None
                        return navigation_distance(perception.facts(controlled.observe())) == distance

                    until(lambda: sees(1.25))
                    assert len(robot.told) == driven  # who navigates drives, nobody else
                    navigation.answer("get_result", key, status=4, error_code=0, error_msg="")
                    assert until(tick) == "done"
                    # Only the topic says the end of another one.
                    activity = NavigateToPose(0.5, 0.0)
                    asked, _ = under_way()

                    def ended() -> str | None:
                        navigation.publish_status(asked.goal_id, 6)
                        return tick()

                    assert until(ended) == "blocked"
                    # Another one, which the run's end gives up.
                    activity = NavigateToPose(2.0, 0.0)
                    asked, _ = under_way()
                    cancel = beside.submit(navigation.take, "cancel_goal")
                    controlled.close()
                    key, given_up = cancel.result()
                    assert bytes(given_up.goal_id.uuid) == bytes(asked.goal_id.uuid)
                    navigation.answer("cancel_goal", key, return_code=0, none=0)
        finally:
            robot.over.set()
            robot.join(LIMIT)


def test_where_nothing_arrives_the_message_says_what_is_there_and_how_to_reach_it(
    endpoint: str, place: dict[str, object]
) -> None:
    with routing(endpoint):
        robot = Robot(place)
        robot.start()
        try:
            with dialling(endpoint) as bus, pytest.raises(LinkError) as caught:
                open_robot(bus, RobotDescription(name="toy"), LinkSettings(gate=False, connect=0.5))
        finally:
            robot.over.set()
            robot.join(LIMIT)
    told = str(caught.value)
    assert "no scan and no odometry has come within 0.5 s: listened on `toy/scan` and `toy/odom`; heard `odom`" in told
    assert "`scan` (sensor_msgs::msg::dds_::LaserScan_)" in told
    assert told.endswith("; give --set link.keys=rmw_zenoh --set robot.namespace=")
