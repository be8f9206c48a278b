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
from tests.tampering import unguarded

BASELINE: Final = "baseline.json"
DB: Final = "adeye.db"
ODD_FILE: Final = "odd/tested.yaml"

ODD: Final[dict[str, Any]] = {
    "odd": "small",
    "scenarios": [
        {"use": "cut_in", "sweep": {"parameters": {"gap": ["40 m", "50 m"]}}},
        {"use": "lead_braking", "sweep": {"parameters": {"deceleration": ["4 m/s^2"]}}},
    ],
    "faults": [
        {
            "id": "nominal_silent",
            "target": "channels.nominal",
            "model": "silent",
            "onset": {"when": "time >= 3 s"},
        },
    ],
    "architectures": ["architectures/camera_radar.yaml"],
    "concept": "concepts/motorway_chauffeur.yaml",
    "gate": {"architectures": ["camera_radar"]},
    "step": "0.05 s",
    "seed": 7,
}
"""Six test cases of one architecture; every mandatory FSR passes."""

PLUGIN: Final = '''
import os
import time

import numpy as np

from adeye.ports import MetricColumn
from tests.tampering import unguarded


class Odd:
    """A metric that goes wrong."""

    uid = "local:odd@1"
    column = "odd_m"
    unit = "m"
    worse = "lower"
    source = "made for this test"

    def compute(self, trace):
        runs = trace.runs
        values = np.full(runs, 5.0)
        statuses = ("value",) * runs
        times = np.zeros(runs)
        actors = (-1,) * runs
        {body}
        return MetricColumn(values, statuses, times, actors)
'''
"""A metric of a plug-in; ``body`` spoils it."""

CHANNEL: Final = """
import os
import time

import numpy as np


class Guest:
    def __init__(self, parameters, context):
        pass

    def act(self, observation):
        {body}
        return 0.0, 0.0
"""


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
        with self.edited("odd/concepts/motorway_chauffeur.yaml") as concept:
            yield next(item for item in concept["requirements"] if item["id"] == name)

    @contextmanager
    def architecture(self) -> Iterator[Any]:
        """Edit the architecture."""
        with self.edited("odd/architectures/camera_radar.yaml") as content:
            yield content

    @contextmanager
    def scenario(self, name: str = "lead_braking") -> Iterator[Any]:
        """Edit a scenario."""
        with self.edited(f"scenarios_db/motorway/{name}.yaml") as content:
            yield content

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
        with self.architecture() as content:
            content["channels"]["nominal"]["kind"] = "./guest.py:Guest"
            content["switch"]["policy"] = "stuck"
