"""Run verbs in this process, in an empty folder, with nothing of the caller's settings."""

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from adeye.cli.app import main


@dataclass(frozen=True)
class Outcome:
    """What a verb did."""

    code: int
    out: str
    err: str

    @property
    def document(self) -> dict[str, Any]:
        """The JSON document on standard output."""
        document: dict[str, Any] = json.loads(self.out)
        return document

    @property
    def refused(self) -> str:
        """What was said of a call that is an input error."""
        assert self.code == 2
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
def adeye(folder: Path, capfd: pytest.CaptureFixture[str]) -> Verb:
    """Return a function that runs a verb as the console script does."""
    assert folder.is_dir()

    def call(*arguments: str) -> Outcome:
        capfd.readouterr()
        given: Sequence[str] = arguments
        code = main(given)
        written = capfd.readouterr()
        return Outcome(code, written.out, written.err)

    return call
