"""``doctor|plugins``: is everything there, what is proven, what comes from outside.

A status never runs ahead of its proof: without a test file the status is ``not yet``.
"""

from __future__ import annotations

import os
import platform
import sys
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Final

import typer

from adeye.cli.options import Db, Json
from adeye.cli.output import clean, emit, emit_json, emit_table, short, talk

# --- ``doctor``: is everything there, and what is proven about the product ------------------------

LIBRARIES: Final = (
    "alembic",
    "gymnasium",
    "highway-env",
    "jinja2",
    "numba",
    "numpy",
    "pandas",
    "pydantic",
    "pyyaml",
    "rich",
    "scipy",
    "sqlalchemy",
    "typer",
)
"""What adeye needs, by the names under which they are installed."""

_ENVIRONMENT: Final = 5

RequirementsFlag = Annotated[
    bool,
    typer.Option(
        "--requirements",
        envvar="ADEYE_REQUIREMENTS",
        help="List the capabilities R1 to R23 with their status and proof instead.",
    ),
]


@dataclass(frozen=True, slots=True)
class Check:
    """Something that was looked at.

    Attributes:
        name: What.
        is_ok: Whether it can be worked with.
        text: What was found, and what to do if it is not good.
    """

    name: str
    is_ok: bool
    text: str


def doctor(requirements: RequirementsFlag = False, db: Db = None, json: Json = False) -> None:
    """Check the installation: versions, database, compiled code, self-test, processors, terminal.

    Whether it finds what is known to be bad is for adeye selftest to try; here is what that told.

    Exit codes: 0 everything can be worked with, 5 something cannot.
    """
    if requirements:
        _print_requirements(json)
        return
    checks = [
        *check_versions(),
        check_database(db),
        check_compiled_code(),
        check_self_test(db),
        _processors(),
        _terminal(),
    ]
    if json:
        emit_json("doctor", {"checks": checks})
    else:
        rows = [["ok" if check.is_ok else "BAD", check.name, check.text] for check in checks]
        emit_table(("", "What", "Found"), rows)
    bad = [check.name for check in checks if not check.is_ok]
    if bad:
        talk(clean(f"{len(bad)} of {len(checks)} are not good: {', '.join(bad)}"))
        raise typer.Exit(_ENVIRONMENT)


def check_versions() -> list[Check]:
    """Look up the versions of adeye, Python and every library that it needs."""
    from importlib.metadata import PackageNotFoundError, version

    from adeye.version import __version__

    checks = [
        Check("adeye", True, __version__),
        Check("python", True, f"{platform.python_version()} ({sys.executable})"),
    ]
    for name in LIBRARIES:
        try:
            checks.append(Check(name, True, version(name)))
        except PackageNotFoundError:
            checks.append(Check(name, False, "not installed; install adeye again"))
    return checks


def check_database(db: str | None) -> Check:
    """Open the database and compare its schema with the one that this release needs."""
    from adeye.errors import AdeyeError
    from adeye.store import schema
    from adeye.store.location import locate

    try:
        location, found = locate(db), schema.current(db)
    except AdeyeError as error:
        return Check("database", False, str(error))
    if found is None and location.path is not None and location.path.exists():
        return Check("database", False, f"{location} was not made by adeye; name another with --db")
    if found is None:
        return Check("database", True, f"{location} does not exist yet; the first run makes it")
    if found != schema.head():
        text = f"{location} has schema {found}, needed is {schema.head()}; run 'adeye db upgrade'"
        return Check("database", False, text)
    return Check("database", True, f"{location}, schema {found}")


def check_compiled_code() -> Check:
    """Look at the folder of compiled code: a cold one costs the first run some seconds."""
    from adeye.kernel.jit import cache_directory, is_cache_warm

    folder = cache_directory()
    writable = os.access(folder if folder.exists() else folder.parent, os.W_OK)
    if not writable:
        return Check("compiled code", False, f"{folder} cannot be written to")
    state = "warm" if is_cache_warm() else "cold: the first run compiles for some seconds"
    return Check("compiled code", True, f"{folder}, {state}")


def check_self_test(db: str | None) -> Check:
    """Look up whether this version was seen to detect the known-bad masters."""
    from adeye.errors import AdeyeError
    from adeye.report.credibility import NOT_RUN, read_result
    from adeye.simulate.engine import NUMERICS_VERSION
    from adeye.store.location import locate
    from adeye.version import __version__

    try:
        folder = locate(db).beside.parent
    except AdeyeError as error:
        return Check("self-test", False, str(error))
    this = {"adeye": __version__, "numerics_version": NUMERICS_VERSION}
    found = read_result(folder, this)
    if found is None:
        return Check("self-test", True, NOT_RUN)
    return Check("self-test", found.is_good, found.text)


def _processors() -> Check:
    from adeye.cli.run import usable_processors

    text = f"{usable_processors()} usable of {os.cpu_count()}, {platform.machine()}"
    return Check("processors", True, text)


def _terminal() -> Check:
    from rich.console import Console

    console = Console()
    encoding = getattr(sys.stdout, "encoding", None) or "unknown"
    kind = "a terminal" if console.is_terminal else "not a terminal"
    text = f"{kind}, {console.width} columns, {encoding}, colours: {console.color_system or 'none'}"
    return Check("standard output", True, text)


def _print_requirements(json: bool) -> None:
    if json:
        emit_json("requirements", {"requirements": CAPABILITIES})
        return
    rows = [[item.id, item.text, item.status.value, item.proof] for item in CAPABILITIES]
    emit_table(("Id", "Capability", "Status", "Proof"), rows)


# --- The 23 capabilities of the platform, and how far each is proven by an executable test --------


class Status(StrEnum):
    """How far a capability is proven."""

    PROVEN = "proven"
    PARTLY = "partly"
    NOT_YET = "not yet"


@dataclass(frozen=True, slots=True)
class Capability:
    """What the platform is able to do.

    Attributes:
        id: R1 to R23.
        text: The capability.
        status: How far it is proven.
        proof: Test file in the repository; empty while there is none.
    """

    id: str
    text: str
    status: Status = Status.NOT_YET
    proof: str = ""


PROOFS: Final = "tests/requirements"

CAPABILITIES: Final = (
    Capability("R1", "worlds and scenarios from several kinds of input"),
    Capability(
        "R2",
        "test automation over many worlds and scenarios, resumable",
        Status.PARTLY,
        f"{PROOFS}/test_r02_automation_over_scenarios.py",
    ),
    Capability(
        "R3",
        "the same campaign from YAML, from the shell and from Python",
        Status.PROVEN,
        f"{PROOFS}/test_r03_yaml_shell_and_python.py",
    ),
    Capability(
        "R4",
        "open nominal and safety logic, readable and replaceable",
        Status.PROVEN,
        f"{PROOFS}/test_r04_open_control_logic.py",
    ),
    Capability(
        "R5",
        "a modular base: parts of third parties plug in without a change",
        Status.PARTLY,
        f"{PROOFS}/test_r05_third_party_parts.py",
    ),
    Capability(
        "R6",
        "physics-based worlds: tyre-road limit, actuators, occlusion, weather",
        Status.PARTLY,
        f"{PROOFS}/test_r06_physics.py",
    ),
    Capability(
        "R7",
        "every sensor parameter can be varied from YAML",
        Status.PROVEN,
        f"{PROOFS}/test_r07_modifiable_sensors.py",
    ),
    Capability(
        "R8",
        "radar, lidar, GNSS, IMU, camera and ultrasonic sensors",
        Status.PROVEN,
        f"{PROOFS}/test_r08_six_sensor_types.py",
    ),
    Capability(
        "R9",
        "ground truth at every tick, to the channels allowed it and to the trace",
        Status.PARTLY,
        f"{PROOFS}/test_r09_ground_truth.py",
    ),
    Capability(
        "R10",
        "a channel controls the ego in closed loop",
        Status.PROVEN,
        f"{PROOFS}/test_r10_channel_controls_ego.py",
    ),
    Capability(
        "R11",
        "vehicles, pedestrians and cyclists, scripted and reactive, together",
        Status.PROVEN,
        f"{PROOFS}/test_r11_several_actors.py",
    ),
    Capability(
        "R12",
        "several channels run and are recorded at every tick",
        Status.PROVEN,
        f"{PROOFS}/test_r12_shadow_commands.py",
    ),
    Capability(
        "R13",
        "control commands are prioritised by a declarative switch",
        Status.PROVEN,
        f"{PROOFS}/test_r13_prioritised_commands.py",
    ),
    Capability(
        "R14",
        "every channel gives commands of one specification",
        Status.PROVEN,
        f"{PROOFS}/test_r14_one_command_specification.py",
    ),
    Capability(
        "R15",
        "commands of different channels can be told apart everywhere",
        Status.PROVEN,
        f"{PROOFS}/test_r15_channels_told_apart.py",
    ),
    Capability(
        "R16",
        "several sensors of one type, by name",
        Status.PROVEN,
        f"{PROOFS}/test_r16_several_sensors_of_a_type.py",
    ),
    Capability(
        "R17",
        "worlds and scenarios made by hand, inherited and overridden",
        Status.PROVEN,
        f"{PROOFS}/test_r17_inherited_scenarios.py",
    ),
    Capability(
        "R18",
        "scenarios are independent of perception and control",
        Status.PROVEN,
        f"{PROOFS}/test_r18_scenarios_independent_of_control.py",
    ),
    Capability(
        "R19",
        "which sensor feeds which channel is configurable and swept",
        Status.PROVEN,
        f"{PROOFS}/test_r19_links.py",
    ),
    Capability(
        "R20",
        "faults injected at run time, by time or condition",
        Status.PROVEN,
        f"{PROOFS}/test_r20_run_time_faults.py",
    ),
    Capability(
        "R21",
        "faults scripted and swept in the file of the sweep",
        Status.PROVEN,
        f"{PROOFS}/test_r21_faults_beside_the_sweep.py",
    ),
    Capability("R22", "co-simulation standards such as FMI"),
    Capability(
        "R23",
        "no tie to a hardware configuration: the same bits everywhere",
        Status.PROVEN,
        f"{PROOFS}/test_r23_any_hardware.py",
    ),
)
"""All capabilities in order."""


# --- ``plugins``: parts from outside the package, offered and named; nothing is imported ----------

OfOdd = Annotated[
    Path | None,
    typer.Argument(
        metavar="[ODD]", help="Whose plug-ins to list; default: only what packages offer."
    ),
]


def plugins(odd: OfOdd = None, json: Json = False) -> None:
    """List plug-ins: what installed packages offer, and what an ODD names. None is imported.

    A plug-in is code with all rights of who runs it. It is loaded only when a file that is planned
    or a stored run that is executed again names it.
    """
    from adeye.campaign.parts import named, offered
    from adeye.spec.load import load_odd

    used = () if odd is None else named(load_odd(odd))
    found = offered()
    if json:
        emit_json("plugins", {"offered": found, "named": used})
        return
    if found:
        emit_table(
            ("Kind", "Name", "Package", "Version", "Write it as"),
            [(item.kind, item.name, item.package, item.version, item.source) for item in found],
            title="Offered by packages",
        )
    else:
        emit("No installed package offers a plug-in.")
    if odd is None:
        return
    if used:
        emit_table(
            ("Kind", "Plug-in", "Code", "Named by"),
            [
                (item.kind, item.source, short(item.digest) if item.digest else "not found",
                 item.owner)
                for item in used
            ],
            title="Named by the ODD and its architectures",
        )  # fmt: skip
    else:
        emit("The ODD names no plug-in.")
