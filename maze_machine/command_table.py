"""The subcommands of ``maze-machine`` as a table: name, group of the help text, place of the function, summary.

The table is all that ``--help`` reads, so that it answers without importing any command.
"""

from __future__ import annotations

from dataclasses import dataclass

DRIVE, WRITE, WORLD, LINK = "Drive", "Write machines", "Mazes and simulation", "Link"
GROUPS = (DRIVE, WRITE, WORLD, LINK)
"""The groups in the order of the help text."""


@dataclass(frozen=True, slots=True)
class Subcommand:
    """A subcommand that is imported on first use.

    Attributes:
        name: what the user types, one word or two.
        group: the heading that it is listed under.
        place: ``MODULE:NAME`` within `maze_machine.commands`; a function, or an app with subcommands of its own.
        summary: the first line of its help text; a test compares it with the function's docstring.
    """

    name: str
    group: str
    place: str
    summary: str

    @property
    def module(self) -> str:
        """The full name of the module."""
        return f"maze_machine.commands.{self.place.partition(':')[0]}"

    @property
    def attribute(self) -> str:
        """The name of the function or the app within the module."""
        return self.place.partition(":")[2]


_SUBCOMMANDS = (
    Subcommand("run", DRIVE, "run:run", "Run a machine on a robot until the machine, the referee or a limit ends it."),
    Subcommand(
        "replay",
        DRIVE,
        "replay:replay",
        "Feed recorded sensors to the same machine, or to another, and show the first difference "
        "from the recorded run.",
    ),
    Subcommand(
        "view",
        DRIVE,
        "view:view",
        "Show a run on a page: the plan, the machine, the reasons of its decisions, variables and time.",
    ),
    Subcommand(
        "plot",
        DRIVE,
        "plot:plot",
        "Plot a recorded run: the path by state, speed, clearance, and the states of each region over time.",
    ),
    Subcommand(
        "watch",
        DRIVE,
        "watch:watch",
        "Watch a running machine: its states, transitions and variables, line by line as they change.",
    ),
    Subcommand(
        "send",
        DRIVE,
        "watch:send",
        "Send an event to a running machine, change a parameter, or pause, resume or end its run.",
    ),
    Subcommand("sweep", DRIVE, "sweep:sweep", "Run machines over mazes and seeds and report the results."),
    Subcommand("sweep show", DRIVE, "sweep:show", "Summarise the results of a sweep."),
    Subcommand(
        "profile",
        DRIVE,
        "profile:profile",
        "Print a robot profile with every setting, its value and what it means, as a TOML file to start your own from.",
    ),
    Subcommand(
        "new",
        WRITE,
        "new:new",
        "Create a project: a machine, its tests, its own library, a robot to drive, editor and CI files.",
    ),
    Subcommand(
        "check",
        WRITE,
        "check:check",
        "Check machines and all that they import: errors, likely mistakes, nondeterminism and incompleteness.",
    ),
    Subcommand(
        "fmt",
        WRITE,
        "fmt:fmt",
        "Format machines in their canonical form: indentation, spaces, arrows in columns; comments and meaning stay.",
    ),
    Subcommand("test", WRITE, "test:test", "Run a machine's scenarios and decide its properties for all its runs."),
    Subcommand(
        "simulate",
        WRITE,
        "simulate:simulate",
        "Try a machine without a robot: set signals, send events, let time pass, ask why, go back, "
        "save it as a scenario.",
    ),
    Subcommand(
        "diagram",
        WRITE,
        "diagram:diagram",
        "Draw a machine: hierarchy, regions, history, guards, time-outs, activities.",
    ),
    Subcommand("import", WRITE, "exchange:import_chart", "Turn a statechart in SCXML into a .maze-machine file."),
    Subcommand("export", WRITE, "exchange:export", "Write a machine for other tools."),
    Subcommand(
        "list",
        WRITE,
        "list:listing",
        "List the names that a machine may use, with types, units and documentation; or the codes of diagnostics.",
    ),
    Subcommand(
        "lsp", WRITE, "lsp:lsp", "Serve an editor over standard input and output, by the Language Server Protocol."
    ),
    Subcommand("dap", WRITE, "dap:dap", "Let an editor debug a machine, by the Debug Adapter Protocol."),
    Subcommand(
        "trust",
        WRITE,
        "trust:trust",
        "Trust a project's own library: its settings name Python code, which no command runs without your consent.",
    ),
    Subcommand("maze", WORLD, "maze:app", "Show mazes, convert them, generate new ones from a seed."),
    Subcommand("map", WORLD, "map:app", "Show a map that a run has saved."),
    Subcommand("sim", LINK, "sim:sim", "Simulate a robot in a maze for a controller in another process."),
    Subcommand(
        "gate",
        LINK,
        "gate:gate",
        "Guard a ROS 2 driver: admit one controller at a time, limit its commands, and stop the base "
        "when it falls silent.",
    ),
    Subcommand(
        "router",
        LINK,
        "router:router",
        "Relay messages between robots and controllers that all connect to this endpoint.",
    ),
    Subcommand(
        "certificates",
        LINK,
        "certificates:certificates",
        "Make a certificate authority and a certificate for every participant of a test network.",
    ),
)

PLACES = {one.name: one for one in _SUBCOMMANDS}
"""Every subcommand by its name, in the order of the help text."""
