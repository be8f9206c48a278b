"""Metrics from outside the package: measured, stored, judged, and part of a result."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from adeye.campaign.parts import plugin_of, use_plugin_metrics
from adeye.errors import InputError
from adeye.judge.metrics import METRICS
from adeye.judge.verdict import Verdict
from adeye.store.read.query import run_query
from adeye.store.tables import METRIC_IDS
from tests.project import CONCEPT, Project

if TYPE_CHECKING:
    from tests.conftest import MakeProject

METRIC = '''
import numpy as np

from adeye.ports import MetricColumn
from adeye.signals import EGO_SPEED


class TopSpeed:
    """Highest speed of the ego in the run."""

    uid = "local:top_speed@1"
    column = "top_speed_mps"
    unit = "m/s"
    worse = "higher"
    source = "ours"

    def compute(self, trace):
        speed = trace["ego"][:, :, EGO_SPEED]
        row = speed.argmax(axis=1)
        runs = trace.runs
        return MetricColumn(speed.max(axis=1), ("value",) * runs, trace.time[row], (-1,) * runs)
'''


@pytest.fixture
def project(make_project: MakeProject) -> Project:
    made = make_project()
    (made.folder / "odd" / "top.py").write_text(METRIC, "utf-8")
    with made.edited_odd() as odd:
        odd["plugins"] = ["./top.py:TopSpeed"]
        odd["scenarios"] = odd["scenarios"][1:]
    with made.edited(CONCEPT) as concept:
        concept["requirements"] = concept["requirements"][:1]
        concept["requirements"].append(
            {
                **concept["requirements"][0],
                "id": "FSR-99",
                "formula": None,
                "bound": {"metric": "top_speed_mps", "at_most": 10.0},
            }
        )
        del concept["requirements"][1]["formula"]
    return made


@pytest.mark.slow
def test_metric_is_stored_in_a_table_of_its_own_and_judged(project: Project) -> None:
    summary = project.run(workers=2)
    line = next(line for line in summary.verdicts if line.fsr == "FSR-99" and line.is_gate)
    assert line.verdict is Verdict.FAIL
    tables = run_query(
        project.db, "SELECT name FROM sqlite_master WHERE type = 'table' AND name LIKE 'metric_%'"
    )
    name = str(tables.rows[0][0])
    query = f"SELECT min(top_speed_mps), count(*) FROM {name}"  # noqa: S608 - our own table
    values = run_query(project.db, query).rows[0]
    assert values[0] == pytest.approx(60 / 3.6, abs=0.2)
    assert values[1] == summary.planned


@pytest.mark.slow
def test_editing_the_metric_executes_its_runs_again(project: Project) -> None:
    first = project.run()
    assert project.run().executed == 0
    path = project.folder / "odd" / "top.py"
    path.write_text(METRIC.replace("Highest speed", "The highest speed"), "utf-8")
    assert project.run().executed == first.planned


def test_another_odd_does_not_see_it(project: Project) -> None:
    project.plan()
    assert plugin_of("top_speed_mps") == "./top.py:TopSpeed"
    use_plugin_metrics((), Path())
    assert plugin_of("top_speed_mps") is None
    assert set(METRICS) == set(METRIC_IDS)


def test_class_that_is_no_metric_is_refused_at_its_line(project: Project) -> None:
    path = project.folder / "odd" / "top.py"
    path.write_text(METRIC.replace("def compute", "def measure"), "utf-8")
    with pytest.raises(InputError, match=r"tested.yaml:\d+:\d+: .* has no compute\(\)"):
        project.plan()
