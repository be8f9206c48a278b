"""R16: a second sensor of a type is a second name; no code."""

import copy
from typing import Any

import numpy as np
import pytest

from adeye.answers import compare_campaign
from adeye.campaign.plan import signal_table
from adeye.report.comparison.records import CompareOptions
from tests.conftest import MakeProject
from tests.project import CANDIDATE, odd_of, run_cases, use
from tests.requirements.test_r08_six_sensor_types import SUITE

pytestmark = pytest.mark.requirements


@pytest.mark.slow
def test_second_radar_is_an_instance_of_its_own(make_project: MakeProject) -> None:
    project = make_project(odd_of("cut_in"))
    alone = project.plan()
    before = run_cases(alone, [alone.cases[0]])
    with project.edited(CANDIDATE) as candidate:
        second = copy.deepcopy(candidate["sensors"]["front_radar"])
        second["mount"]["y"] = "0.5 m"
        candidate["sensors"]["right_radar"] = second
    plan = project.plan()
    trace = run_cases(plan, [plan.cases[0]])
    names = trace.layout.sensors
    assert {"front_radar", "right_radar"} <= set(names)
    one, other = names.index("front_radar"), names.index("right_radar")
    seen = np.asarray(trace["detected"][0, :, :, 0], dtype=np.bool_)
    both = seen[:, one] & seen[:, other]
    assert both.sum() > 20
    places = trace["detections"][0, :, :, 0]
    assert not np.any(np.all(places[both, one] == places[both, other], axis=-1))
    # The first one measures what it measured alone.
    then = before.layout.sensors.index("front_radar")
    assert np.array_equal(before["detections"][0, :, then], places[:, one, np.newaxis])
    names_of_signals = {row.name for row in signal_table(plan)}
    assert "sensor.right_radar.detects.cutter" in names_of_signals


def drives(rows: list[dict[str, Any]], architecture: str) -> list[dict[str, Any]]:
    """The runs of an architecture in the order of their situations."""
    own = [row for row in rows if row["architecture"] == architecture]
    return sorted(own, key=lambda row: str(row["situation"]))


def told(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Situation, outcome, verdicts and every metric."""
    words = {"situation", "outcome", "verdicts"}
    return [
        {key: value for key, value in row.items() if key in words or isinstance(value, float)}
        for row in rows
    ]


@pytest.mark.slow
def test_further_sensor_that_nobody_reads_changes_no_verdict_and_no_drive(
    make_project: MakeProject,
) -> None:
    """Of any model: a suite, its copy, and the suite with one more of each, on common numbers."""
    names = ("suite", "copy", "spare")
    axes = {"gap": ["15 m", "30 m"], "ego_speed": ["80 km/h", "120 km/h"]}
    swept = use("cut_in", {**axes, "rain": ["0 mm/h", "7.5 mm/h"]})
    project = make_project(odd_of(swept, architectures=names))
    base = project.read(CANDIDATE)
    base["sensors"] = SUITE | {"truth": base["sensors"]["truth"]}
    base["channels"]["nominal"]["links"] = list(SUITE)
    for name in names:
        made = copy.deepcopy(base) | {"architecture": name}
        if name == "spare":
            made["sensors"] |= {f"spare_{id_}": record for id_, record in SUITE.items()}
        project.write(f"odd/architectures/{name}.yaml", made)
    summary = project.run()
    assert summary.executed == 24
    rows = {name: drives(project.rows(), name) for name in names}
    assert len(rows["suite"]) == 8
    # What is told of the drive itself; the traces of the spare have more columns.
    assert told(rows["suite"]) == told(rows["copy"]) == told(rows["spare"])
    assert "max_deceleration_mps2" in told(rows["suite"])[0]
    digests = {name: {row["trace_digest"] for row in rows[name]} for name in names}
    assert digests["copy"] == digests["suite"]
    comparison = compare_campaign(project.db, (), CompareOptions(baseline="suite"))
    pairs = {(item.a, item.b) for item in comparison.differences}
    assert pairs >= {("suite", "copy"), ("suite", "spare")}
    for item in comparison.differences:
        assert item.only_a_fails == item.only_b_fails == 0
        assert all(one == other for one, other in (words.split("/") for words in item.verdicts))
        if item.margin is not None:
            assert (item.margin.least, item.margin.greatest) == (0.0, 0.0)
