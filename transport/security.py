"""TLS with certificates on both sides, and access control by the names in them.

A folder holds the authority's certificate ``ca.pem``, for each participant ``NAME.pem`` and ``NAME.key``, and
``access.toml``, which says who may drive which robot. The listening side (a robot or a router) enforces it; what it
does not allow is denied.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from transport.files import write_text
from transport.keys import MachineKeys, RobotKeys
from transport.settings import LinkSettings
from transport.toml import TomlError, read_toml
from transport.wording import in_words

AUTHORITY = "ca.pem"
ACCESS = "access.toml"


class SecurityError(Exception):
    """A certificate, key or access file that is missing or cannot be used."""


class Access(BaseModel):
    """Who may do what, by the names in their certificates."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    robots: list[str] = Field(default_factory=list)
    """Robots: each may appear only under its own name."""
    controllers: dict[str, list[str]] = Field(default_factory=dict)
    """Controllers, and the robots that each may drive."""
    watchers: dict[str, list[str]] = Field(default_factory=dict)
    """Who may only watch, and at which robots and their machines."""
    operators: dict[str, list[str]] = Field(default_factory=dict)
    """Who may also send events to the machines that drive these robots, and pause and end their runs."""


@dataclass(frozen=True, slots=True)
class Identity:
    """A participant's certificate.

    Attributes:
        folder: where the certificates are.
        name: whose it is.
    """

    folder: Path
    name: str

    @classmethod
    def at(cls, path: Path) -> Identity:
        """The identity at ``FOLDER/NAME``.

        Raises:
            SecurityError: one of its files is missing.
        """
        identity = cls(path.parent, path.name)
        for file in (identity.folder / AUTHORITY, identity.certificate, identity.key):
            if not file.is_file():
                raise SecurityError(f"{file} is missing: `maze-machine certificates` makes a set of certificates")
        return identity

    @property
    def certificate(self) -> Path:
        """Its certificate, signed by the authority."""
        return self.folder / f"{self.name}.pem"

    @property
    def key(self) -> Path:
        """Its private key."""
        return self.folder / f"{self.name}.key"

    def dialling(self) -> dict[str, object]:
        """Session settings for the connecting side: it shows its certificate and requires the other's."""
        side = {"certificate": str(self.certificate), "private_key": str(self.key)}
        return {
            "transport/link/tls/root_ca_certificate": str(self.folder / AUTHORITY),
            "transport/link/tls/enable_mtls": True,
            "transport/link/tls/verify_name_on_connect": True,
            **{
                f"transport/link/tls/{way}_{what}": value
                for way in ("connect", "listen")
                for what, value in side.items()
            },
        }

    def listening(self, settings: LinkSettings | None = None) -> dict[str, object]:
        """Session settings for the listening side: the same, and what ``access.toml`` allows is all that is allowed.

        Raises:
            SecurityError: ``access.toml`` is missing or invalid.
        """
        access = read_access(self.folder / ACCESS)
        return {**self.dialling(), "access_control": access_control(access, settings or LinkSettings())}


def read_access(path: Path) -> Access:
    """Read an access file.

    Raises:
        SecurityError: it is missing or invalid.
    """
    try:
        return Access.model_validate(read_toml(path))
    except OSError as error:
        raise SecurityError(f"{path}: {error.strerror}") from None
    except TomlError as error:
        raise SecurityError(f"{path}: {error}") from None
    except ValidationError as error:
        raise SecurityError(f"{path}: {in_words(error.errors()[0])}") from None


def access_control(access: Access, settings: LinkSettings) -> dict[str, object]:
    """Zenoh's access control for an access file: everything is denied but what a role needs."""
    rules = _Rules()
    for robot in access.robots:
        keys = RobotKeys(robot, settings)
        shown, answered = [keys.scan, keys.odometry, keys.clock], [keys.session, keys.door]
        rules.allow(robot, "ingress", ["put"], shown)
        rules.allow(robot, "ingress", ["declare_subscriber"], [keys.command, keys.door])
        rules.allow(robot, "ingress", ["declare_queryable", "reply"], answered)
        rules.allow(robot, "egress", _ALL, [f"{robot}/**"])
    for name, robots in access.controllers.items():
        for robot in robots:
            keys = RobotKeys(robot, settings)
            rules.allow(name, "ingress", ["put"], [keys.command, keys.door])
            rules.allow(name, "ingress", ["query"], [keys.session, keys.door])
            machine = MachineKeys(robot)
            rules.allow(name, "ingress", ["put"], [machine.step])
            rules.allow(
                name,
                "ingress",
                ["declare_queryable", "reply"],
                [machine.model, machine.step, machine.why, machine.sights, machine.operate],
            )
            _look_on(rules, name, keys)
    for name, robots in access.watchers.items():
        for robot in robots:
            _look_on(rules, name, RobotKeys(robot, settings))
    for name, robots in access.operators.items():
        for robot in robots:
            _look_on(rules, name, RobotKeys(robot, settings))
            rules.allow(name, "ingress", ["query"], [MachineKeys(robot).operate])
    return rules.table()


_ALL = ("put", "reply", "query", "declare_subscriber", "declare_queryable")


def _look_on(rules: _Rules, name: str, keys: RobotKeys) -> None:
    machine = MachineKeys(keys.namespace)
    rules.allow(name, "ingress", ["declare_subscriber"], [keys.scan, keys.odometry, keys.clock, machine.step])
    rules.allow(name, "ingress", ["query"], [machine.model, machine.step, machine.why, machine.sights])
    rules.allow(name, "egress", _ALL, [f"{keys.namespace}/**"])


@dataclass
class _Rules:
    """Zenoh's three lists: what, who, and who may what."""

    rules: list[dict[str, object]] = field(default_factory=list)
    subjects: dict[str, list[str]] = field(default_factory=dict)

    def allow(self, name: str, flow: str, messages: Sequence[str], keys: Iterable[str]) -> None:
        """Allow a participant some messages on some keys."""
        rule = f"rule {len(self.rules)}"
        self.rules.append(
            {
                "id": rule,
                "permission": "allow",
                "flows": [flow],
                "messages": list(messages),
                "key_exprs": list(dict.fromkeys(keys)),
            }
        )
        self.subjects.setdefault(name, []).append(rule)

    def table(self) -> dict[str, object]:
        """As Zenoh's configuration has it."""
        return {
            "enabled": True,
            "default_permission": "deny",
            "rules": self.rules,
            "subjects": [{"id": name, "cert_common_names": [name]} for name in self.subjects],
            "policies": [{"subjects": [name], "rules": rules} for name, rules in self.subjects.items()],
        }


def make_certificates(folder: Path, access: Access, hosts: Sequence[str] = ()) -> list[Path]:
    """Make an authority and a certificate for every participant in an access file: for tests, not for production.

    The authority's key is not kept, so nobody can be added later: make a new set.

    Args:
        folder: where to write; made if it is not there.
        access: who takes part.
        hosts: names and addresses of participants, besides this computer's own loopback.

    Returns:
        the files that were written.

    Raises:
        SecurityError: the folder has certificates already, or cannot be written.
        ImportError: the package ``trustme`` is missing (the extra ``certificates``).
    """
    from trustme import CA  # noqa: PLC0415  only this command needs it

    if (folder / AUTHORITY).exists():
        raise SecurityError(f"{folder} holds certificates already: choose another folder")
    authority = CA(organization_name="maze-machine test authority")
    names = sorted({*access.robots, *access.controllers, *access.watchers, *access.operators, "router"})
    try:
        folder.mkdir(parents=True, exist_ok=True)
        authority.cert_pem.write_to_path(folder / AUTHORITY)
        for name in names:
            issued = authority.issue_cert("localhost", "127.0.0.1", "::1", *hosts, common_name=name)
            identity = Identity(folder, name)
            identity.key.touch(mode=0o600)
            issued.private_key_pem.write_to_path(identity.key)
            issued.cert_chain_pems[0].write_to_path(identity.certificate)
        write_text(folder / ACCESS, access_text(access))
    except OSError as error:
        raise SecurityError(f"cannot write certificates to {folder}: {error.strerror}") from None
    made = [Identity(folder, name) for name in names]
    return [folder / AUTHORITY, *(path for one in made for path in (one.certificate, one.key)), folder / ACCESS]


def access_text(access: Access) -> str:
    """An access file's text."""
    lines = ["# Who may do what, by the names in their certificates; everything else is denied.", ""]
    lines += [f"robots = {_names(access.robots)}", "", "# who may drive which robots", "[controllers]"]
    lines += [f'"{name}" = {_names(robots)}' for name, robots in access.controllers.items()]
    lines += ["", "# who may watch at which robots", "[watchers]"]
    lines += [f'"{name}" = {_names(robots)}' for name, robots in access.watchers.items()]
    lines += ["", "# who may send events to the machines that drive which robots", "[operators]"]
    lines += [f'"{name}" = {_names(robots)}' for name, robots in access.operators.items()]
    return "\n".join(lines) + "\n"


def _names(names: Iterable[str]) -> str:
    return "[" + ", ".join(f'"{name}"' for name in names) + "]"
