"""The console of `simulate`: the lines of a scenario, and some commands."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from hsm.testing.scenarios.session import Moment, Session, SessionError
from maze_machine.errors import FileError
from transport.files import write_text

HELP = """\
lines of a scenario, which are recorded:
  when door.near, not space.front     signals change
  when rotate reports done            an activity ends
  when event go                       somebody sends an event
  when cruise = 0.4 m/s               somebody changes an adjustable parameter
  after 2 s                           time passes
  expect driving within 5 s           wait for it, or report that it does not hold
  given door.near                     restart, with this from the start
and commands of this program:
  set turns = 2       give a variable or a parameter a value
  tick [N]            let N ticks pass
  micro [LINE]        do a line, or a tick, and show its microsteps one by one; again: the next one
  why [STATE]         why transitions fired or did not in the last step
  enabled             what makes each transition of the active states fire next, or why nothing does
  break [CONDITION]   stop a wait in a state (break moving), at a transition (break line 12; of an imported machine:
                      break door:12) or where something comes to hold (break turns == 2); alone: do not
  back [N]            undo the last N lines
  lines               the lines so far
  save FILE [NAME]    add the session to a file of scenarios
  help, quit"""


_ASKING = frozenset(("help", "lines", "why", "enabled", "break", "save", "micro"))
"""Words that do nothing to the run."""
SCENARIOS = ".maze-test"
"""What a file of scenarios ends in."""


@dataclass(slots=True)
class Console:
    """Takes lines for a session.

    Attributes:
        session: the run.
        save_in: the one folder that ``save`` writes to; None for any.
    """

    session: Session
    save_in: Path | None = None
    _coming: list[Moment] = field(default_factory=list)  # the microsteps that were not shown yet

    def do(self, line: str) -> Moment | str:
        """Execute a line: the run's state after it, or the answer.

        Raises:
            SessionError: it is not possible.
            FileError: a file cannot be written.
        """
        word, _, rest = line.strip().partition(" ")
        rest = rest.strip()
        if word not in _ASKING:
            self._coming = []
        match word:
            case "help":
                return HELP
            case "lines":
                return "\n".join(self.session.lines) or "nothing yet"
            case "why":
                return "\n".join(self.session.why(rest or None))
            case "enabled":
                return "\n".join(map(str, self.session.prospects())) or "no transition leads on"
            case "break":
                self.session.stop_when(rest or None)
                return ""
            case "save":
                return self._save(rest)
            case "back":
                return self.session.back(_count(rest))
            case "tick":
                for _ in range(_count(rest)):
                    moment = self.session.tick()
                return moment
            case "micro":
                return self._microstep(rest)
            case _:
                return self.session.do(line)

    def _microstep(self, line: str) -> Moment | str:
        """The next microstep of the last step; where all were shown, or a line is given, that of a new step."""
        if line or not self._coming:
            done = self.do(line or "tick")
            if isinstance(done, str):
                return done
            self._coming = self.session.microsteps()
            if not self._coming:
                return done
        return self._coming.pop(0)

    def answer(self, line: str) -> str:
        """The same as a text.

        Raises:
            SessionError: it is not possible.
            FileError: a file cannot be written.
        """
        done = self.do(line)
        return done if isinstance(done, str) else moment_text(done)

    def _save(self, rest: str) -> str:
        """Append the session to a file of scenarios, which is created if it does not exist."""
        name, _, title = rest.partition(" ")
        if not name:
            raise SessionError("save FILE [NAME]")
        path = Path(name)
        if path.suffix != SCENARIOS:
            raise SessionError(f"{path}: a file of scenarios ends in {SCENARIOS}")
        if self.save_in is not None:
            if path.name != name:
                raise SessionError(f"{path}: give a name without folders; the file is put into {self.save_in}")
            path = self.save_in / name
        scenario = self.session.scenario(title.strip() or "what was tried")
        try:
            before = path.read_text(encoding="utf-8") if path.exists() else f"test {self.session.machine}\n"
            write_text(path, f"{before.rstrip()}\n\n{scenario}")
        except (OSError, UnicodeDecodeError) as error:
            raise FileError(f"{path} cannot be written: {getattr(error, 'strerror', None) or error}") from None
        return f"saved to {path}"


def moment_text(moment: Moment) -> str:
    """The state of a run, for a person."""
    lines = [f"{moment.time:8.3f} s  {', '.join(moment.states) or 'no state'}"]
    for head, parts in (
        ("took", moment.taken),
        ("called", moment.called),
        ("raised", moment.raised),
        ("violated", moment.violated),
        ("doing", moment.doing),
        ("with", [f"{name} = {value}" for name, value in moment.variables.items()]),
    ):
        if parts:
            lines.append(f"            {head} {', '.join(parts)}")
    if moment.outcome is not None:
        lines.append(f"            ended in {moment.outcome}")
    return "\n".join(lines)


def _count(text: str) -> int:
    if not text:
        return 1
    if not text.isdecimal() or len(text) > 6 or not 1 <= int(text) <= 100_000:
        raise SessionError(f"`{text[:40]}` is not a count: write 1 to 100000")
    return int(text)
