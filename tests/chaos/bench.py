"""What every way to lose evidence needs: a project to spoil, verbs, and the database's bytes."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pytest
import yaml

from adeye.cli.app import main
from tests.project import CANDIDATE, CANDIDATE_ONLY, CONCEPT, MINI
from tests.stored import stored
from tests.tampering import unguarded

BASELINE: Final = "baseline.json"
DB: Final = "adeye.db"
ODD_FILE: Final = "odd/tested.yaml"

ODD: Final[dict[str, Any]] = {
    **MINI,
    "odd": "small",
    "scenarios": [
        {"use": "cut_in", "sweep": {"parameters": {"gap": ["40 m", "50 m"]}}},
        {"use": "lead_braking", "sweep": {"parameters": {"deceleration": ["4 m/s^2"]}}},
    ],
    "faults": MINI["faults"][1:],
    "architectures": CANDIDATE_ONLY,
}
"""Six test cases of one architecture; every mandatory FSR passes."""
PLUGIN: Final[str] = stored("plugins")["spoilt_metric"]
"""A metric of a plug-in; ``body`` spoils it."""
CHANNEL: Final[str] = stored("plugins")["guest"]


def fsr_of(concept: Any, name: str) -> dict[str, Any]:
    """Find an FSR of a concept."""
    found: dict[str, Any] = next(i for i in concept["requirements"] if i["id"] == name)
    return found


@dataclass(frozen=True)
class Said:
    """What a verb ended with."""

    code: int
    text: str


@dataclass(frozen=True)
class Bench:
    """A copy of a green campaign to spoil."""

    folder: Path
    monkeypatch: pytest.MonkeyPatch
    capfd: pytest.CaptureFixture[str]

    def adeye(self, *arguments: str) -> Said:
        """Run a verb in this process, as the console script does."""
        self.capfd.readouterr()
        code = main(arguments)
        written = self.capfd.readouterr()
        return Said(code, written.out + written.err)

    def run(self, *options: str) -> Said:
        """Run the ODD into the database."""
        return self.adeye("run", ODD_FILE, "--db", DB, "--quiet", *options)

    def gate(self, *options: str) -> Said:
        """Judge the newest campaign against the baseline."""
        return self.adeye("gate", "--db", DB, "--baseline", BASELINE, *options)

    def run_and_gate(self) -> Said:
        """Run what an edit left, then judge it against the baseline."""
        self.run()
        return self.gate()

    @contextmanager
    def edited(self, name: str = ODD_FILE) -> Iterator[Any]:
        """Edit a YAML file."""
        content = yaml.safe_load((self.folder / name).read_text("utf-8"))
        yield content
        self.write(name, content)

    def write(self, name: str, content: Any) -> None:
        """Write a YAML file."""
        path = self.folder / name
        path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")

    @contextmanager
    def fsr(self, name: str) -> Iterator[dict[str, Any]]:
        """Edit an FSR of the concept."""
        with self.edited(CONCEPT) as concept:
            yield fsr_of(concept, name)

    def tamper(self, *statements: str) -> None:
        """Change the database as somebody with the file and a shell, and leave no other trace."""
        with sqlite3.connect(self.folder / DB) as raw:
            with unguarded(raw):
                changed = sum(raw.execute(statement).rowcount for statement in statements)
            assert changed > 0
        raw.close()

    def metric(self, body: str) -> None:
        """Judge an FSR by a metric of a plug-in."""
        (self.folder / "odd" / "odd_metric.py").write_text(PLUGIN.format(body=body), "utf-8")
        with self.edited() as odd:
            odd["plugins"] = ["./odd_metric.py:Odd"]
        with self.fsr("FSR-06") as fsr:
            del fsr["formula"]
            fsr["bound"] = {"metric": "odd_m", "at_least": 1.0}

    def channel(self, body: str) -> None:
        """Put a channel of a plug-in in the place of the nominal one, with no other to help."""
        folder = self.folder / "odd" / "architectures"
        (folder / "guest.py").write_text(CHANNEL.format(body=body), "utf-8")
        with self.edited(CANDIDATE) as content:
            content["channels"]["nominal"]["kind"] = "./guest.py:Guest"
            content["switch"]["policy"] = "stuck"
