"""Runs of shipped ODDs and architectures, pinned: what happened, metrics, verdicts, margins.

Whatever moves one of them, in a sensor, a channel, a fault, the road or a metric, is seen here.
"""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest

from adeye.store.tables import METRIC_IDS
from tests.frozen import assert_frozen, described
from tests.project import ROOT, Project, odd_of, run_cases, use
from tests.sql import rows
from tests.stored import read_yaml


def first_of(axis: Any) -> Any:
    """Leave one value of an axis."""
    if isinstance(axis, list):
        return axis[:1]
    return [axis["from"]] if isinstance(axis, dict) else "sample 1 seed 3"


def narrow(project: Project, odd: dict[str, Any]) -> None:
    """Leave one scenario with one value of each axis, and what is asked of it."""
    use = odd["scenarios"][0]
    axes = use["sweep"]["parameters"]
    swept = {"parameters": {name: first_of(axis) for name, axis in axes.items()}}
    project.write("odd/tested.yaml", {**odd, "scenarios": [{**use, "sweep": swept}]})
    with project.edited(f"odd/{odd['concept']}") as concept:
        concept["requirements"] = [
            {**item, **({"scenarios": [use["use"]]} if "scenarios" in item else {})}
            for item in concept["requirements"]
            if use["use"] in item.get("scenarios", [use["use"]])
        ]


def number(value: float | None) -> str:
    return "none" if value is None else f"{value:.9g}"


def told(db: Path) -> str:
    """Write each run of a database in words and numbers, in the order of the campaign."""
    columns = ("run", "scenario", "architecture", "fault_entry", "outcome", "end_reason")
    metrics = [
        f"{name}{part}" for name in METRIC_IDS for part in ("", "_status", "_time_s", "_actor")
    ]
    names = [*columns, "duration_s", *metrics]
    verdicts, events = defaultdict(list), defaultdict(list)
    for run, fsr, verdict, margin, time, actor, signal in rows(
        db, "SELECT run, fsr, verdict, margin, time_s, actor, signal FROM v_verdicts ORDER BY fsr"
    ):
        verdicts[run].append(
            f"  {fsr} {verdict} {number(margin)} of {signal} at {number(time)} {actor or ''}"
        )
    for run, time, kind, subject, text in rows(
        db,
        "SELECT result_digest, time_s, kind, subject, text FROM event "
        "JOIN run ON number = run_number ORDER BY run_number, seq",
    ):
        events[run].append(f"  {number(time)} {kind} {subject}: {text}")
    lines = []
    for row in rows(db, f"SELECT {', '.join(names)} FROM v_runs ORDER BY ordinal"):  # noqa: S608 - names of columns
        cells = dict(zip(names, row, strict=True))
        lines.append(", ".join(str(cells[name]) for name in columns[1:]))
        lines[-1] += f" after {number(cells['duration_s'])} s"
        for name in METRIC_IDS:
            if cells[f"{name}_status"] == "value":
                at, actor = cells[f"{name}_time_s"], cells[f"{name}_actor"]
                lines.append(f"  {name} {number(cells[name])} at {number(at)} {actor or ''}")
        lines += [*verdicts[cells["run"]], *events[cells["run"]]]
    return "".join(f"{line.rstrip()}\n" for line in lines)


@pytest.mark.parametrize("name", ["sensor_study", "urban_pedestrian_rain"])
def test_runs_of_a_shipped_odd_are_frozen(tmp_path: Path, name: str) -> None:
    project = Project(tmp_path / "project")
    for kind in ("architectures", "concepts"):
        for path in (ROOT / "odd" / kind).glob("*.yaml"):
            project.folder.joinpath("odd", kind, path.name).write_bytes(path.read_bytes())
    odd = project.read(f"odd/{name}.yaml")
    narrow(project, odd)
    project.run()
    assert_frozen(f"runs_{name}.txt", told(project.db))


ARCHITECTURES = (
    "legacy_camera", "lidar", "merging_camera_radar", "reference_cc", "supervised",
    "supervised_adeye", "trajectory",
)  # fmt: skip


CAMPAIGN = read_yaml(ROOT / "odd" / "fault_campaign.yaml")
FAULTS = (
    "phantom", "oscillating", "localisation_late", "map_shifted", "planner_frozen", "brake_fade",
    "friction_step", "switch_stuck",
)  # fmt: skip


def recorded(folder: Path, architecture: str, **odd: Any) -> str:
    """Run what is planned as one batch and write each column of its trace."""
    faults = [item["id"] for item in odd.get("faults", ())] or ["none"]
    content = odd_of(use("cut_in", faults=faults), architectures=[architecture], **odd)
    project = Project(folder / "project", content)
    project.require("FSR-01")
    plan = project.plan()
    trace = run_cases(plan, [case for case in plan.cases if case.fault_entry == faults[0]])
    lines = [f"length {trace.length.tolist()}, horizon {trace.horizon_row.tolist()}"]
    for column, values in trace.columns.items():
        lines += described(values, column)
        lines += described(values[0, 60], f"  {column} at 3 s")
    return "\n".join([*lines, ""])


@pytest.mark.parametrize("name", ARCHITECTURES)
def test_trace_of_each_architecture_is_frozen(tmp_path: Path, name: str) -> None:
    """What it records of one cut-in."""
    assert_frozen(f"trace_{name}.txt", recorded(tmp_path, name))


@pytest.mark.parametrize("name", FAULTS)
def test_trace_with_each_fault_is_frozen(tmp_path: Path, name: str) -> None:
    """What is recorded of one cut-in after a fault at 3 s."""
    [fault] = [item for item in CAMPAIGN["faults"] if item["id"] == name]
    assert_frozen(f"trace_{name}.txt", recorded(tmp_path, "supervised", faults=[fault]))
