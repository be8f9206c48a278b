"""What tests of the whole product share: a project on disk and one small executed campaign.

The process that only hands tests out reads this, too, and the others wait for it: the product is
imported where it is used.
"""

from __future__ import annotations

import gc
import os
import signal
import time
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import pytest
from hypothesis import HealthCheck, settings

from tests import postgres

if TYPE_CHECKING:
    from adeye.sweep.case import TestCase
    from adeye.trace import Trace
    from tests.postgres import Server
    from tests.project import Executed, Project

MakeProject: TypeAlias = "Callable[..., Project]"

# How fast a machine is decides no test.
settings.register_profile(
    "any_machine", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any_machine")

# A compiler and a suite make many objects that stay: to look through them at every 700th takes a
# fifth of the time.
gc.set_threshold(100_000)

_BEGAN = pytest.StashKey[float]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let who has only so much time say so."""
    parser.addoption(
        "--budget",
        type=float,
        metavar="SECONDS",
        help="begin no test after so many seconds; what is left belongs to `make full`",
    )


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Begin at the other end in every second process: two meet in the middle.

    Pytest takes half of the time of finding tests to rewrite their assertions. What one process has
    rewritten the other one loads.
    """
    report = yield
    worker = getattr(collector.config, "workerinput", {"workerid": "gw0"})["workerid"]
    if isinstance(collector, pytest.Directory) and int(worker.removeprefix("gw")) % 2:
        report.result.reverse()
    return report


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> Generator[None, None, None]:
    """Mark what needs a PostgreSQL server, by its fixtures and parameters."""
    # All processes know the tests by their numbers, at whichever end they began.
    items.sort(key=lambda item: item.path)
    for item in items:
        callspec = getattr(item, "callspec", None)
        values = [] if callspec is None else list(callspec.params.values())
        on_server = any(isinstance(value, str) and value == "postgresql" for value in values)
        if on_server or "server" in getattr(item, "fixturenames", ()):
            item.add_marker("server")
    yield


def pytest_collection_finish(session: pytest.Session) -> None:
    """Spare the collector of rubbish the tests themselves; the budget begins when all are found."""
    gc.collect()
    gc.freeze()
    session.config.stash[_BEGAN] = time.monotonic()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Begin nothing after the budget; order is random, so each time it is another part."""
    budget = item.config.getoption("budget")
    if budget is not None and time.monotonic() - item.config.stash[_BEGAN] > budget:
        pytest.skip("left to `make full`: the budget is spent")


# What a shell starts in the background ignores Ctrl-C, and so would what tests send it to.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def make_project(tmp_path: Path) -> MakeProject:
    """Return a maker of projects, the mini ODD unless another is given."""
    from tests.project import Project

    def make(odd: dict[str, Any] | None = None, *, name: str = "project") -> Project:
        return Project(tmp_path / name, odd)

    return make


@pytest.fixture(scope="session")
def mini(tmp_path_factory: pytest.TempPathFactory) -> Executed:
    """The mini campaign, executed in this process; nobody writes to it."""
    from tests.project import Executed, Project

    project = Project(tmp_path_factory.mktemp("mini") / "project")
    plan = project.plan()
    return Executed(project, plan, project.run(), project.db)


@pytest.fixture(scope="session")
def suites(tmp_path_factory: pytest.TempPathFactory) -> Executed:
    """A campaign of five architectures to compare, executed; nobody writes to it."""
    from tests.suites import build_suites

    return build_suites(tmp_path_factory.mktemp("suites") / "project")


@pytest.fixture(scope="session")
def cut_ins(mini: Executed) -> tuple[list[TestCase], Trace]:
    """The cut-ins of the candidate whose nominal channel falls silent, in one trace."""
    from tests.project import run_cases

    cases = [
        case
        for case in mini.plan.cases
        if case.scenario_id == "cut_in"
        and case.architecture.architecture == "camera_radar"
        and case.fault_entry == "nominal_silent"
    ]
    return cases, run_cases(mini.plan, cases)


@pytest.fixture(scope="session")
def server() -> Iterator[Server]:
    """A PostgreSQL server; in the continuous integration it must be there."""
    if postgres.binaries() is None:
        if os.environ.get("CI") == "true":
            pytest.fail("PostgreSQL is missing; its tests must run here")
        pytest.skip("PostgreSQL is not installed")
    yield from postgres.running()
