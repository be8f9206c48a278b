"""What a campaign comes to, run by run and metric by metric, in a table short enough to keep.

A model that changes on purpose changes the table: ``python -m tests.numbers`` writes it anew, and
the difference shows which runs and which metrics moved.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
from pathlib import Path
from typing import Any

from adeye.store.tables import METRIC_IDS
from tests.project import Project
from tests.stored import write_yaml

TABLE = Path(__file__).parent / "content" / "mini_numbers.yaml"

_DIGITS = 9
"""Significant digits of a value: what sums up in another order is no other result."""


def numbers_of(rows: list[dict[str, Any]]) -> dict[str, dict[str, str]]:
    """Return the trace digest and verdicts of each run, and a digest of each metric over them."""
    ordered = sorted(rows, key=lambda row: row["ordinal"])
    return {
        "traces": {_name(row): row["trace_digest"] for row in ordered},
        "outcomes": {_name(row): _outcome(row) for row in ordered},
        # Whatever plug-ins others have left in the process.
        "metrics": {
            name: _digest([_measured(row, name) for row in ordered]) for name in METRIC_IDS
        },
    }


def _name(row: dict[str, Any]) -> str:
    point = " ".join(f"{value:g}" for value in row["point"].values())
    return f"{row['architecture']} {row['scenario']} {point} {row['fault_entry']}"


def _outcome(row: dict[str, Any]) -> str:
    verdicts = " ".join(f"{name}={row['verdicts'][name]}" for name in sorted(row["verdicts"]))
    return f"{row['outcome']} {row['end_reason']} {row['duration_s']:g} s {verdicts}"


def _measured(row: dict[str, Any], name: str) -> list[str]:
    said = [row[f"{name}{ending}"] for ending in ("", "_status", "_time_s", "_actor")]
    return [f"{item:.{_DIGITS}g}" if isinstance(item, float) else str(item) for item in said]


def _digest(values: list[list[str]]) -> str:
    return hashlib.blake2b(json.dumps(values).encode(), digest_size=6).hexdigest()


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        project = Project(Path(folder) / "project")
        project.run()
        write_yaml(TABLE, numbers_of(project.rows()))
