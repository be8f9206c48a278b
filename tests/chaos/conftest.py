"""A small campaign that is green, with its baseline, and a way to run verbs beside it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from adeye.cli.app import main
from tests.chaos.bench import BASELINE, ODD, Bench
from tests.chaos.runners import Cradle, Undisturbed, project_of, size, undisturbed
from tests.project import Project


@pytest.fixture(scope="session")
def green(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run the campaign and take its baseline, once; nobody writes to it."""
    project = Project(tmp_path_factory.mktemp("green") / "project", ODD)
    assert main(["run", str(project.odd), "--db", str(project.db), "--quiet"]) == 0
    update = ["gate", "--db", str(project.db), "--baseline", str(project.folder / BASELINE)]
    assert main([*update, "--update"]) == 0
    return project.folder


@pytest.fixture
def unset(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Take away the caller's settings."""
    for name in os.environ:
        if name.startswith("ADEYE_") and name != "ADEYE_NUMBA_CACHE_DIR":
            monkeypatch.delenv(name)
    monkeypatch.setenv("COLUMNS", "500")
    return monkeypatch


@pytest.fixture
def bench(
    green: Path, tmp_path: Path, unset: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> Iterator[Bench]:
    """Copy the green campaign, and work in its folder."""
    folder = tmp_path / "project"
    shutil.copytree(green, folder)
    unset.chdir(folder)
    yield Bench(folder, unset, capfd)
    # Plug-ins of one test are none of the next one's.
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="session")
def cradle(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cradle]:
    """Start the process that forks runners, once."""
    started = Cradle(tmp_path_factory.mktemp("cradle"))
    started.warm(project_of(tmp_path_factory.mktemp("warm") / "project", 2).folder)
    yield started
    started.close()


@pytest.fixture(scope="session")
def whole(cradle: Cradle, tmp_path_factory: pytest.TempPathFactory) -> Undisturbed:
    """Run the campaign that is disturbed in the tests, undisturbed."""
    runs = size(300, 2_000)
    return undisturbed(cradle, tmp_path_factory.mktemp("whole") / "project", runs, block=10)


@pytest.fixture(scope="session")
def little(cradle: Cradle, tmp_path_factory: pytest.TempPathFactory) -> Undisturbed:
    """Run a campaign of a few runs, for what is tried at very many places."""
    return undisturbed(cradle, tmp_path_factory.mktemp("little") / "project", 12, block=4)
