"""``doctor``: is everything there, and what is proven about the product."""

from __future__ import annotations

import os
import platform
import sys
from dataclasses import dataclass
from typing import Annotated, Final

import typer

from adeye.cli.options import Db, Json
from adeye.cli.output import clean, emit_json, emit_table, talk

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
    from adeye.engine import NUMERICS_VERSION
    from adeye.errors import AdeyeError
    from adeye.report.credibility import NOT_RUN, read_result
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
    from adeye.cli.capabilities import CAPABILITIES

    if json:
        emit_json("requirements", {"requirements": CAPABILITIES})
        return
    rows = [[item.id, item.text, item.status.value, item.proof] for item in CAPABILITIES]
    emit_table(("Id", "Capability", "Status", "Proof"), rows)
