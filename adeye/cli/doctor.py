"""``doctor|plugins``: is everything there, what is proven, what comes from outside.

A status never runs ahead of its proof: without a test file the status is ``not yet``.
"""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Final

import typer

from adeye.cli.options import Db, Json
from adeye.cli.output import clean, emit, emit_found, emit_json, emit_records, short, talk
from adeye.errors import AdeyeError
from adeye.judge.verdict import ExitCode
from adeye.version import __version__

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


def doctor(requirements: bool = False, db: Db = None, json: Json = False) -> None:
    """Check the installation: versions, database, compiled code, self-test, processors, terminal.

    Whether it finds what is known to be bad is for adeye selftest to try; here is what that told.

    Exit codes: 0 everything can be worked with, 5 something cannot.

    Parameters:
        requirements: List the capabilities R1 to R23 with their status and proof instead.

    Examples:
        adeye doctor
        adeye doctor --requirements
    """
    if requirements:
        emit_found(
            "requirements",
            capabilities(),
            _print_requirements,
            json=json,
            document=lambda found: {"requirements": found},
        )
        return
    checks = [
        *check_versions(),
        check_database(db),
        check_compiled_code(),
        check_self_test(db),
        _programs(),
        _processors(),
        _terminal(),
    ]
    emit_found("doctor", checks, _print_checks, json=json, document=lambda it: {"checks": it})
    bad = [check.name for check in checks if not check.is_ok]
    if bad:
        talk(clean(f"{len(bad)} of {len(checks)} are not good: {', '.join(bad)}"))
        raise typer.Exit(ExitCode.ENVIRONMENT)


def _print_checks(checks: Sequence[Check]) -> None:
    columns: dict[str, str | Callable[[Check], object]]
    columns = {"": lambda check: "ok" if check.is_ok else "BAD", "What": "name", "Found": "text"}
    emit_records(checks, columns)


def check_versions() -> list[Check]:
    """Look up the versions of adeye, Python and every library that it needs."""
    from importlib.metadata import PackageNotFoundError, version

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
    from adeye.report.credibility import NOT_RUN, read_result
    from adeye.simulate.engine import NUMERICS_VERSION
    from adeye.store.location import locate

    try:
        folder = locate(db).beside.parent
    except AdeyeError as error:
        return Check("self-test", False, str(error))
    this = {"adeye": __version__, "numerics_version": NUMERICS_VERSION}
    found = read_result(folder, this)
    if found is None:
        return Check("self-test", True, NOT_RUN)
    return Check("self-test", found.is_good, found.text)


def _programs() -> Check:
    from adeye.simulate.bridges.programs import is_confined

    text = "any file: this system has no Landlock"
    if is_confined():
        text = "counted files and installed software (Landlock)"
    return Check("programs can read", True, text)


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


def _print_requirements(found: Sequence[Capability]) -> None:
    emit_records(found, {"Id": "id", "Capability": "text", "Status": "status", "Proof": "proof"})


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
    status: Status
    proof: str


def capabilities() -> list[Capability]:
    """Read all capabilities in order from ``capabilities.yaml``."""
    from adeye.packaged import packaged_yaml

    return [
        Capability(
            name,
            item["text"],
            Status(item.get("status", Status.NOT_YET)),
            f"tests/requirements/{item['proof']}.py" if "proof" in item else "",
        )
        for name, item in packaged_yaml("adeye.cli", "capabilities.yaml").items()
    ]


# --- ``plugins``: parts from outside the package, offered and named; nothing is imported ----------


def plugins(
    odd: Annotated[Path | None, typer.Argument(metavar="[ODD]")] = None, json: Json = False
) -> None:
    """List plug-ins: what installed packages offer, and what an ODD names. None is imported.

    A plug-in is code with all rights of who runs it. It is loaded only when a file that is planned
    or a stored run that is executed again names it.

    Parameters:
        odd: Whose plug-ins to list; default: only what packages offer.

    Examples:
        adeye plugins
        adeye plugins odd/first.yaml --json
    """
    from adeye.campaign.parts import named, offered
    from adeye.spec.load import load_odd

    used = () if odd is None else named(load_odd(odd))
    found = offered()
    if json:
        emit_json("plugins", {"offered": found, "named": used})
        return
    if found:
        names = {"Kind": "kind", "Name": "name", "Package": "package", "Version": "version"}
        emit_records(found, {**names, "Write it as": "source"}, title="Offered by packages")
    else:
        emit("No installed package offers a plug-in.")
    if odd is None:
        return
    if used:
        emit_records(
            used,
            {
                "Kind": "kind",
                "Plug-in": "source",
                "Code": lambda item: short(item.digest) if item.digest else "not found",
                "Named by": "owner",
            },
            title="Named by the ODD and its architectures",
        )
    else:
        emit("The ODD names no plug-in.")
