"""Certificates and access control: who is let in, what they may do, and that nobody else gets through."""

from __future__ import annotations

import stat
import threading
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from toy_world import PERIOD, ToyWorld, seen, wander

from tests.transport.serving import serving
from transport.bus import Bus, Mailbox, Message
from transport.codec import encode_twist
from transport.connect import connect_robot, dialling, listening, routing
from transport.description import RobotDescription
from transport.lockstep import LockstepServer
from transport.messages import Twist
from transport.robot import LinkError
from transport.security import Access, Identity, SecurityError, access_text, make_certificates, read_access
from transport.settings import LinkSettings
from transport.world import LockstepRobot

ACCESS = Access(
    robots=["pico1", "pico2"],
    controllers={"alice": ["pico1"], "bob": ["pico1", "pico2"]},
    watchers={"eve": ["pico1"]},
)
PATIENT = LinkSettings(connect=30.0, step=30.0)
QUICK = LinkSettings(connect=1.0)
"""For those who are to be turned away."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ca")
    make_certificates(folder, ACCESS)
    return folder


@pytest.fixture
def secure(endpoint: str) -> str:
    return endpoint.replace("tcp/", "tls/")


@contextmanager
def shown(bus: Bus, name: str) -> Iterator[LockstepServer]:
    server = LockstepServer(bus, name, PERIOD, ToyWorld, patience=0.3)
    with serving(server):
        yield server


@contextmanager
def robot_side(endpoint: str, folder: Path) -> Iterator[LockstepServer]:
    security = Identity.at(folder / "pico1").listening()
    with listening(endpoint, security=security) as bus, shown(bus, "pico1") as server:
        yield server


def drive(
    endpoint: str, robot: str, identity: Identity, *, seed: int = 1, steps: int = 20, settings: LinkSettings = PATIENT
) -> list[object]:
    description = RobotDescription(name=robot)
    there = connect_robot(endpoint, description, settings, seed=seed, security=identity.dialling())
    rows = []
    for _ in range(steps):
        observation = there.observe()
        rows.append(seen(observation))
        there.command(wander(observation))
    there.close()
    return rows


def expected(seed: int = 1, steps: int = 20) -> list[object]:
    robot, rows = LockstepRobot(ToyWorld(seed)), []
    for _ in range(steps):
        rows.append(seen(robot.observe()))
        robot.command(wander(robot.observe()))
    return rows


def test_a_controller_with_a_certificate_drives(secure: str, folder: Path) -> None:
    with robot_side(secure, folder):
        assert drive(secure, "pico1", Identity.at(folder / "alice")) == expected()


def test_another_authoritys_certificate_is_not_let_in(secure: str, folder: Path, tmp_path: Path) -> None:
    make_certificates(tmp_path / "other", ACCESS)
    forged = Identity.at(tmp_path / "other" / "alice")
    (tmp_path / "other" / "ca.pem").write_bytes((folder / "ca.pem").read_bytes())
    with robot_side(secure, folder), pytest.raises(LinkError, match="nothing answers"):
        drive(secure, "pico1", forged, settings=QUICK)


def test_without_a_certificate_nobody_is_let_in(secure: str, folder: Path) -> None:
    only_trust = {"transport/link/tls/root_ca_certificate": str(folder / "ca.pem")}
    with robot_side(secure, folder):
        for security, endpoint in ((only_trust, secure), (None, secure.replace("tls/", "tcp/"))):
            with pytest.raises(LinkError, match="nothing answers"):
                connect_robot(endpoint, RobotDescription(name="pico1"), QUICK, security=security)


def test_a_robot_that_is_not_the_authoritys_is_not_believed(secure: str, folder: Path, tmp_path: Path) -> None:
    make_certificates(tmp_path / "other", ACCESS)
    impostor = Identity.at(tmp_path / "other" / "pico1").listening()
    alice = Identity.at(folder / "alice")
    with (
        listening(secure, security=impostor) as bus,
        shown(bus, "pico1"),
        pytest.raises(LinkError, match="certificate"),
    ):
        drive(secure, "pico1", alice, settings=QUICK)


@pytest.mark.parametrize("name", ["pico2", "eve"])
def test_a_known_participant_without_the_right_can_neither_take_nor_command_nor_ring(
    secure: str, folder: Path, name: str
) -> None:
    intruder = Identity.at(folder / name)
    with robot_side(secure, folder) as server:
        with pytest.raises(LinkError, match="no robot named 'pico1' answered"):
            drive(secure, "pico1", intruder, settings=QUICK)
        with dialling(secure, security=intruder.dialling()) as bus:
            for key in ("pico1/cmd_vel", "pico1/open_door"):
                bus.publisher(key).put(encode_twist(Twist(0.5)), b"x" * 64)
        assert drive(secure, "pico1", Identity.at(folder / "alice")) == expected()
        assert not server.dropped["malformed"]


def test_a_watcher_sees_and_no_more(secure: str, folder: Path) -> None:
    with robot_side(secure, folder), dialling(secure, security=Identity.at(folder / "eve").dialling()) as bus:
        seen_by_eve: Mailbox[Message] = Mailbox()
        bus.subscribe("pico1/scan", seen_by_eve.put)
        assert drive(secure, "pico1", Identity.at(folder / "alice")) == expected()
        assert seen_by_eve.take(60.0) is not None


def test_through_a_router_each_drives_only_what_it_may(secure: str, folder: Path) -> None:
    with ExitStack() as stack:
        stack.enter_context(routing(secure, security=Identity.at(folder / "router").listening()))
        for name in ("pico1", "pico2"):
            bus = stack.enter_context(dialling(secure, security=Identity.at(folder / name).dialling()))
            stack.enter_context(shown(bus, name))
        assert drive(secure, "pico1", Identity.at(folder / "alice"), seed=1) == expected(1)
        assert drive(secure, "pico2", Identity.at(folder / "bob"), seed=2) == expected(2)
        with pytest.raises(LinkError, match="no robot named 'pico2' answered"):
            drive(secure, "pico2", Identity.at(folder / "alice"), settings=QUICK)


def test_a_robot_cannot_show_itself_as_another(secure: str, folder: Path) -> None:
    with ExitStack() as stack:
        stack.enter_context(routing(secure, security=Identity.at(folder / "router").listening()))
        bus = stack.enter_context(dialling(secure, security=Identity.at(folder / "pico2").dialling()))
        stack.enter_context(shown(bus, "pico1"))
        with pytest.raises(LinkError, match="no robot named 'pico1' answered"):
            drive(secure, "pico1", Identity.at(folder / "alice"), settings=QUICK)


def test_two_robots_and_two_controllers_on_one_router_do_not_hear_each_other(endpoint: str) -> None:
    rows: dict[str, list[object]] = {}
    steps: dict[str, object] = {}

    def run(name: str, seed: int) -> None:
        robot = connect_robot(endpoint, RobotDescription(name=name), PATIENT, seed=seed)
        rows[name] = []
        for _ in range(50):
            observation = robot.observe()
            rows[name].append(seen(observation))
            robot.command(wander(observation))
        steps[name] = robot.report()["steps"]
        robot.close()

    with ExitStack() as stack:
        stack.enter_context(routing(endpoint))
        for name in ("pico1", "pico2"):
            bus = stack.enter_context(dialling(endpoint))
            stack.enter_context(shown(bus, name))
        threads = [threading.Thread(target=run, args=(f"pico{seed}", seed)) for seed in (1, 2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
    assert rows == {"pico1": expected(1, 50), "pico2": expected(2, 50)}
    assert steps == {"pico1": 50, "pico2": 50}


def test_private_keys_are_for_their_owner_only(folder: Path) -> None:
    for key in folder.glob("*.key"):
        assert stat.S_IMODE(key.stat().st_mode) == 0o600


def test_the_access_file_is_read_as_it_was_written(folder: Path) -> None:
    assert read_access(folder / "access.toml") == ACCESS
    assert tomllib.loads(access_text(ACCESS))["robots"] == ["pico1", "pico2"]


def test_certificates_are_not_overwritten(folder: Path) -> None:
    with pytest.raises(SecurityError, match="holds certificates already"):
        make_certificates(folder, ACCESS)


def test_a_missing_certificate_and_a_bad_access_file_are_one_message(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(SecurityError, match=r"mallory\.pem is missing"):
        Identity.at(folder / "mallory")
    for text, message in (("robots = 3", "robots"), ("robots = [", "Invalid value"), ("king = 1", "king")):
        (tmp_path / "access.toml").write_text(text)
        with pytest.raises(SecurityError, match=message) as caught:
            read_access(tmp_path / "access.toml")
        assert "\n" not in str(caught.value)


def test_handshakes_that_fail_do_not_stop_a_run_under_way(secure: str, folder: Path) -> None:
    with robot_side(secure, folder):
        done = threading.Event()

        def knock() -> None:
            while not done.is_set():
                with pytest.raises(LinkError):
                    connect_robot(
                        secure,
                        RobotDescription(name="pico1"),
                        LinkSettings(connect=0.1),
                        security={"transport/link/tls/root_ca_certificate": str(folder / "ca.pem")},
                    )

        thread = threading.Thread(target=knock)
        thread.start()
        try:
            assert drive(secure, "pico1", Identity.at(folder / "alice"), steps=100) == expected(steps=100)
        finally:
            done.set()
            thread.join(60)
