"""The verbs of ``adeye`` by name; the module of one is imported when somebody asks for it."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from copy import copy
from dataclasses import dataclass
from difflib import get_close_matches
from importlib import import_module
from types import ModuleType
from typing import Any, Final

import typer
from typer.core import TyperCommand, TyperGroup

from adeye.cli.options import add, as_it_stands
from adeye.cli.output import clean, talk


@dataclass(frozen=True, slots=True)
class Verb:
    """What the list of all verbs tells of one, which is what its own help begins with.

    Attributes:
        panel: Heading that the list has it under.
        place: Its module in ``adeye.cli`` and what it is called there.
        summary: First paragraph of its help.
    """

    panel: str
    place: str
    summary: str


_TABLE: Final = {
    "Plan and run": {
        "plan": (
            "plan:plan",
            "Check an ODD and everything it names, and count its test cases. Nothing is executed.",
        ),
        "run": (
            "run:run",
            "Execute the test cases of an ODD, judge every FSR, and exit with the "
            "verdict of the gate.",
        ),
        "coverage": (
            "plan:coverage",
            "Count which attributes of an ODD its test cases have, one by one and together.",
        ),
        "judge": (
            "run:judge",
            "Judge the results that are there as the ODD and its concept ask for "
            "now; execute nothing new.",
        ),
        "gate": (
            "gate:gate",
            "Judge a campaign that has been run, and exit with the verdict of the gate.",
        ),
        "stale": (
            "gate:stale",
            "Say which evidence of the newest campaign no longer counts, and why.",
        ),
        "signals": ("plan:signals", "List the signals that the FSRs of an ODD may name."),
        "sensors": (
            "sensors:sensors",
            "Analyse the sensor suites of architectures without simulation, side by side.",
        ),
        "dependencies": (
            "plan:dependencies",
            "List what could make two channels of the switch fail together. Nothing is executed.",
        ),
        "reference": (
            "results.preventability:reference",
            "Let the reference drivers of UN R157 drive scenes, without a campaign.",
        ),
        "check": (
            "gate:check",
            "Check that concept, plan and evidence fit together. Nothing is executed.",
        ),
        "uncertainty": (
            "results.confidence:uncertainty",
            "Show what halving the step changes in margins and metrics: the numeric uncertainty.",
        ),
    },
    "Read results": {
        "show": (
            "results.show:show",
            "Show a run as it is stored: outcome, what failed and why, parameters, events.",
        ),
        "trace": (
            "results.trace:trace",
            "Give the signals of a run over time: a row a tick, a column for all "
            "that formulas may name.",
        ),
        "plot": (
            "results.trace:plot",
            "Draw signals of a run over time, with the limits that FSRs set on "
            "them and what happened.",
        ),
        "replay": (
            "results.show:replay",
            "Execute a stored run again and compare the digest of its trace.",
        ),
        "timeline": (
            "results.faults:timeline",
            "Show what follows the fault of a run: times, intervals, and the FTTI "
            "that was measured.",
        ),
        "faults": (
            "results.faults:faults",
            "Count what became of the faults of a campaign, by scenario, fault "
            "entry and architecture.",
        ),
        "fork": (
            "results.faults:fork",
            "Execute a stored run again with another authority from a tick on.",
        ),
        "forks": (
            "results.faults:forks",
            "Say of the takeovers of a campaign whether each was needed, done, late or missed.",
        ),
        "preventability": (
            "results.preventability:preventability",
            "Let reference drivers of UN R157 drive the conflicts of a campaign, "
            "and say who avoids them.",
        ),
        "query": ("results.query:query", "Ask the database in SQL. Nothing can be changed by it."),
        "where": (
            "results.where:where",
            "Tell where among the swept values an FSR fails, and by how much.",
        ),
        "diff": (
            "results.diff:diff",
            "Tell what changed from one campaign to another. Nothing is executed.",
        ),
        "stl": (
            "results.query:stl",
            "Evaluate a formula on a table with a column of times: verdict, robustness, and why.",
        ),
        "compare": (
            "results.compare:compare",
            "Compare the architectures of a campaign on the test cases that they share.",
        ),
        "confidence": (
            "results.confidence:confidence",
            "Bound the probability that an FSR is violated, where the design allows it.",
        ),
        "report": (
            "run:report",
            "Write the report of a campaign that has been run: HTML, JUnit XML, "
            "JSON, SARIF, GSN, ReqIF.",
        ),
        "matrix": (
            "results.compare:matrix",
            "Show what follows from what: hazardous event, goal, FSR, element, scenario, verdict.",
        ),
        "export": (
            "results.query:export",
            "Write a campaign as typed tables: runs, verdicts, events, status of the FSRs.",
        ),
    },
    "Write your own": {
        "init": (
            "new:init",
            "Write a small project: an ODD, an architecture and a safety concept, ready to run.",
        ),
        "new": ("new:new_app", "Write a working example of a part of your own: it runs as it is."),
        "channel": ("guests:channel_app", "Check channels from outside by themselves."),
        "fmu": ("guests:fmu_app", "Look at FMUs, step them by themselves, export parts."),
        "map": ("maps:map_app", "Read maps of others: show, import, check, draw and export them."),
        "scenario": (
            "scenario:scenario_app",
            "List, show and check the scenarios of the catalogue.",
        ),
    },
    "Keep it healthy": {
        "plugins": (
            "doctor:plugins",
            "List plug-ins: what installed packages offer, and what an ODD names. "
            "None is imported.",
        ),
        "warmup": (
            "run:warmup",
            "Compile the kernels that ODDs need, and keep the machine code for every later run.",
        ),
        "selftest": (
            "certify:selftest",
            "Take known-bad masters through plan, run, judge, store and exit "
            "code, and count the found.",
        ),
        "certify": (
            "certify:certify",
            "Certify that a campaign is deterministic: no result depends on how it was executed.",
        ),
        "doctor": (
            "doctor:doctor",
            "Check the installation: versions, database, compiled code, self-"
            "test, processors, terminal.",
        ),
        "db": (
            "database:database_app",
            "Create, upgrade, describe, verify, merge and copy databases.",
        ),
        "manifest": (
            "database:manifest_app",
            "Sign the evidence of a campaign, and check what was signed.",
        ),
    },
}
VERBS: Final = {
    name: Verb(panel, place, summary)
    for panel, verbs in _TABLE.items()
    for name, (place, summary) in verbs.items()
}
"""All verbs by name, in the order of the list."""

_PREFIX: Final = "ADEYE_"
_NO_OPTIONS: Final = {"DB", "HELLO", "KEY", "NUMBA_CACHE_DIR"}
"""Variables, without the prefix, that are read without an option, or set for nodes."""


class _Commands(Mapping[str, Any]):
    """The verbs as commands, each made when it is first asked for."""

    def __init__(self) -> None:
        self._made: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._made:
            self._made[name] = _command(name, VERBS[name])
        return self._made[name]

    def __contains__(self, name: object) -> bool:
        return name in VERBS

    def __iter__(self) -> Iterator[str]:
        return iter(VERBS)

    def __len__(self) -> int:
        return len(VERBS)


def _command(name: str, verb: Verb) -> Any:
    module, _, called = verb.place.partition(":")
    found = getattr(import_module(f"adeye.cli.{module}"), called)
    if isinstance(found, typer.Typer):
        found.info.cls = _Group
        command: Any = typer.main.get_group(found)
    else:
        app = typer.Typer(add_completion=False, rich_markup_mode="rich")
        add(app, found, name=name)
        command = typer.main.get_command(app)
    command.name, command.rich_help_panel = name, verb.panel
    return command


class _Later(type):
    """A class that is imported when it is first used."""

    def _real(cls) -> Any:
        return getattr(import_module(cls.__module__), cls.__name__)

    def __call__(cls, *given: Any, **named: Any) -> Any:
        return cls._real()(*given, **named)

    def __getattr__(cls, name: str) -> Any:
        return getattr(cls._real(), name)


class _LaterModule(ModuleType):
    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return _Later(name, (), {"__module__": self.__name__})


def _import_drawing() -> None:
    """Import what draws help, without what it never draws here: half of the time it would take."""
    wanted = {"rich.markdown", "rich.traceback"} - sys.modules.keys()
    sys.modules.update({name: _LaterModule(name) for name in wanted})
    try:
        import_module("typer.rich_utils")
    finally:
        for name in wanted:
            del sys.modules[name]


class _Group(TyperGroup):
    """Verbs of one family."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help as it stands."""
        _import_drawing()
        super(_Group, as_it_stands(self, ctx)).format_help(ctx, formatter)


class Program(_Group):
    """The program: all verbs, of which no more is imported than the one that is called."""

    def __init__(self, **settings: Any) -> None:
        """Take the verbs instead of what was registered."""
        super().__init__(**settings)
        self.commands: Any = _Commands()

    def invoke(self, ctx: Any) -> Any:
        """Name what of the environment nothing reads, and carry out the verb."""
        said = {name.removeprefix(_PREFIX) for name in os.environ if name.startswith(_PREFIX)}
        if said := said - _NO_OPTIONS:
            known = {name.removeprefix(_PREFIX) for name in _variables(self, ctx)}
            for name in sorted(said - known):
                near = get_close_matches(name, sorted(known), n=1)
                hint = f"Did you mean {_PREFIX}{near[0]}?" if near else "See the verb's --help."
                talk(clean(f"note: no option reads {_PREFIX}{name} of the environment. {hint}"))
        return super().invoke(ctx)

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002 - of a library
        """Return the names, without a look at the commands themselves."""
        return list(self.commands)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the list of verbs with what the table tells of them."""
        told = copy(self)
        told.commands = {
            name: TyperCommand(
                name, help=verb.summary, rich_help_panel=verb.panel, rich_markup_mode="rich"
            )
            for name, verb in VERBS.items()
        }
        super(Program, told).format_help(ctx, formatter)


def _variables(group: Any, ctx: Any) -> set[str]:
    """Return all variables that set an option of a group or of what is below it."""
    found: set[str] = set()
    below = [group, *(group.get_command(ctx, name) for name in group.list_commands(ctx))]
    for command in below:
        found |= {param.envvar for param in command.params if param.envvar}
        if command is not group and isinstance(command, TyperGroup):
            found |= _variables(command, ctx)
    return found
