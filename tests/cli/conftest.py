"""Run verbs in this process, in an empty folder, with nothing of the caller's settings."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from adeye.cli.app import main
from tests.project import Executed


@dataclass(frozen=True)
class Outcome:
    """What a verb did.

    Attributes:
        verb: Its words and options.
        code: Exit code.
        out: Standard output.
        err: Standard error.
    """

    verb: tuple[str, ...]
    code: int
    out: str
    err: str

    @property
    def document(self) -> dict[str, Any]:
        """The JSON document on standard output, whose schema is that of the verb."""
        document: dict[str, Any] = json.loads(self.out)
        if self.verb[:2] != ("db", "metadata"):  # which is what datasette reads
            assert re.fullmatch(rf"adeye/{self.verb[0]}(-[a-z-]+)?@1", document["schema"])
        return document

    @property
    def ok(self) -> Outcome:
        """The same, if it was a success."""
        assert self.code == 0, self.err
        return self

    @property
    def refused(self) -> str:
        """What was said of a call that is an input error; such a call prints nothing."""
        assert (self.code, self.out) == (2, "")
        return self.err


Verb = Callable[..., Outcome]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in an empty folder, without ADEYE_* settings."""
    for name in os.environ:
        if name.startswith("ADEYE_") and name != "ADEYE_NUMBA_CACHE_DIR":
            monkeypatch.delenv(name)
    monkeypatch.setenv("COLUMNS", "500")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def of_mini(folder: Path, mini: Executed) -> tuple[str, str]:
    """Name the database of the mini campaign, to which nobody writes."""
    assert folder.is_dir()
    return "--db", str(mini.db)


@pytest.fixture
def of_suites(folder: Path, suites: Executed) -> tuple[str, str]:
    """Name the database of the campaign of several suites, to which nobody writes."""
    assert folder.is_dir()
    return "--db", str(suites.db)


@pytest.fixture
def copied(folder: Path, mini: Executed) -> str:
    """Copy the mini campaign, so that it may be written to."""
    return str(shutil.copyfile(mini.db, folder / "adeye.db"))


@pytest.fixture
def adeye(folder: Path, capfd: pytest.CaptureFixture[str]) -> Verb:
    """Return a function that runs a verb as the console script does."""
    assert folder.is_dir()

    def call(*arguments: str) -> Outcome:
        capfd.readouterr()
        code = main(arguments)
        return Outcome(arguments, code, *capfd.readouterr())

    return call
