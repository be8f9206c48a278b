"""Faults in the report: groups, rates, takeovers."""

import json
import shutil
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lxml import html as lxml_html

from adeye.campaign.studies.fault_timing import campaign_injections
from adeye.campaign.studies.forks import look_back
from adeye.errors import InputError
from adeye.judge.preventability import TAKEOVER_CLASSES
from adeye.judge.timeline import CLASSES
from adeye.report.faults import debounce_axes, rate_of, trade_curves, trades_by
from adeye.report.formats.json import parse_json, render_json
from adeye.report.model.assessment import FaultEvidence, TradeCurve
from adeye.report.model.report import Report
from adeye.report.page.html import render
from adeye.store.tables import METRIC_IDS
from tests.figures import figures_of
from tests.noisy import CONFIRM, noisy_project
from tests.project import Executed
from tests.refusals import refused
from tests.report.pages import built, section
from tests.stored import known


def told(report: Report) -> FaultEvidence:
    assert report.faults is not None
    return report.faults


@pytest.fixture(scope="module")
def measured(mini: Executed, tmp_path_factory: pytest.TempPathFactory) -> Report:
    db = shutil.copyfile(mini.db, tmp_path_factory.mktemp("measured") / "adeye.db")
    campaign_injections(db)
    look_back(db)
    return built(db)


def test_what_was_not_measured_is_said_with_its_command(plain: Report) -> None:
    found = told(plain)
    assert (found.with_fault, found.measured, found.forked) == (16, 0, 0)
    assert found.groups == ()
    assert found.takeovers is None
    text = section(plain, "faults")
    assert "Not measured: what became of the faults in 16 runs" in text
    for verb in ("faults", "forks"):
        assert f"adeye {verb} {plain.campaign[:10]} --sample 0 --db my.db" in text
    assert "spurious" not in text


def test_every_run_with_a_fault_is_in_one_class_of_one_group(measured: Report) -> None:
    found = told(measured)
    assert sum(sum(group.counts.values()) for group in found.groups) == found.measured == 16
    assert all(tuple(group.counts) == CLASSES for group in found.groups)
    assert all(group.low is None for group in found.groups)
    assert "Not measured" not in section(measured, "faults")


def test_worst_run_of_a_silent_channel_has_its_times_and_command(measured: Report) -> None:
    [group] = [
        item
        for item in told(measured).groups
        if (item.architecture, item.fault_entry) == ("camera_radar", "nominal_silent")
    ]
    worst = group.worst
    assert worst.class_ == "detected_in_time"
    assert worst.margin_s is not None
    assert (worst.ftti_s, worst.fhti_s) == (group.least_ftti_s, group.most_fhti_s)
    assert worst.command == f"adeye replay {worst.run[:12]} --db my.db"


def test_takeovers_are_counted_and_the_wrong_ones_listed_in_the_json_too(
    measured: Report,
) -> None:
    found = known(told(measured).takeovers)
    assert tuple(found.counts) == TAKEOVER_CLASSES
    assert found.runs == told(measured).executed == 28
    assert {item.class_ for item in found.listed} == {"missed"}
    assert len(found.listed) == found.counts["missed"]
    text = render_json(measured)
    assert json.loads(text)["faults"]["measured"] == 16
    assert told(parse_json(text)) == told(measured)


def test_runs_without_a_fault_have_a_rate_and_an_availability(measured: Report) -> None:
    calm = told(measured).calm
    assert [item.architecture for item in calm] == ["camera_radar", "legacy_camera"]
    for item in calm:
        assert item.rate.runs == 6
        assert item.rate.per_hour == item.rate.trips / item.rate.hours
        assert item.availability is not None
        assert 0.9 < item.availability <= 1.0
        assert item.rate.low is None


def test_page_has_a_bar_for_every_group(measured: Report) -> None:
    tree = lxml_html.document_fromstring(render(measured))
    rows = tree.xpath("//table[contains(@class, 'timing')]/tbody/tr")
    assert len(rows) == len(told(measured).groups)
    runs = {str(run) for run in tree.xpath("//table[contains(@class, 'timing')]//@data-run")}
    assert runs == {group.worst.run for group in told(measured).groups}


def test_runs_that_depend_on_the_machine_are_counted_at_the_top(plain: Report) -> None:
    assert plain.machine_dependent == 0
    assert "wall-clock" not in render(plain)
    page = render(plain.model_copy(update={"machine_dependent": 3}))
    [summary] = lxml_html.document_fromstring(page).xpath("//section[@id='summary']")
    assert "3 runs depend on the machine" in " ".join(summary.text_content().split())


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    project = noisy_project(tmp_path_factory.mktemp("noisy"))
    project.run()
    return project.db


@pytest.fixture(scope="module")
def curve(db: Path) -> TradeCurve:
    _, [found] = trades_by(db, None, "confirm")
    return found


def test_longer_debounce_trips_less_and_detects_later(curve: TradeCurve) -> None:
    assert [point.value for point in curve.points] == ["0 s", "0.1 s", "0.2 s"]
    trips = [point.calm.trips for point in curve.points]
    assert trips[0] > trips[-1]
    assert all(one >= two for one, two in pairwise(trips))
    medians = [point.median_fdti_s for point in curve.points]
    worst = [point.worst_fdti_s for point in curve.points]
    # Staleness takes the same time at each value, so that the debounce alone is the difference.
    assert medians[2] == pytest.approx((medians[0] or 0.0) + 0.2)
    assert all((one or 9.0) < (two or 0.0) for one, two in pairwise(medians))
    assert all((a or 9.0) <= (b or 0.0) for a, b in zip(medians, worst, strict=True))


def test_every_run_is_in_one_point_and_a_grid_has_a_rate_without_an_interval(
    curve: TradeCurve,
) -> None:
    assert curve.axis == CONFIRM
    assert curve.title == "safety.confirm"
    assert [(point.calm.runs, point.faulty) for point in curve.points] == [(8, 8)] * 3
    for point in curve.points:
        assert point.detected == 8
        assert point.calm.per_hour == pytest.approx(point.calm.trips / point.calm.hours)
        assert (point.calm.low, point.calm.high) == (None, None)
    assert json.loads(curve.model_dump_json())["points"][0]["value"] == "0 s"


def test_unknown_axis_is_refused_with_those_that_there_are(db: Path) -> None:
    refused(InputError, trades_by, db, None, "weather", says=r"does not sweep it.*deceleration")


def row(confirm: float, fault: str, **metrics: Any) -> dict[str, Any]:
    return {
        **dict.fromkeys(METRIC_IDS),
        "scenario": "drawn",
        "architecture": "new",
        "fault_entry": fault,
        "point": {CONFIRM: confirm},
        "duration_s": 1800.0,
        **metrics,
    }


def odd(design: str) -> dict[str, Any]:
    use = {"use": "drawn", "sweep": {"design": design, "parameters": {CONFIRM: {"from": "0 s"}}}}
    return {"odd": {"scenarios": [use]}, "scenarios": {}}


def test_random_sample_has_the_exact_interval_of_a_rate() -> None:
    figures = figures_of([row(0.0, "none", trips=value) for value in (2.0, 1.0)])
    [curve] = trade_curves(figures, odd("random"), CONFIRM)
    calm = curve.points[0].calm
    assert (calm.trips, calm.hours, calm.per_hour) == (3, 1.0, 3.0)
    # Garwood's interval of 3 events.
    assert calm.low == pytest.approx(0.6187, abs=1e-4)
    assert calm.high == pytest.approx(8.7673, abs=1e-4)
    assert curve.points[0].value == "0 s"


def test_undetected_faults_are_counted_and_have_no_time() -> None:
    rows = [row(0.5, "out", fault_detection_time_s=value) for value in (0.4, None, 0.2, 0.3)]
    [point] = trade_curves(figures_of(rows), odd("random"), CONFIRM)[0].points
    assert (point.faulty, point.detected) == (4, 3)
    assert (point.median_fdti_s, point.worst_fdti_s) == (0.3, 0.4)
    assert point.calm.per_hour is None


def test_fault_that_did_not_begin_is_none_that_was_not_detected() -> None:
    rows = [row(0.5, "out", fault_detection_time_s=0.4), row(0.5, "out", has_fault=False)]
    [point] = trade_curves(figures_of(rows), odd("random"), CONFIRM)[0].points
    assert (point.faulty, point.detected) == (1, 1)


def test_run_of_an_older_release_counts_neither_trips_nor_hours() -> None:
    figures = figures_of([row(0.0, "none", trips=1.0), row(0.0, "none")])
    rate = rate_of(figures, np.ones(2, dtype=np.bool_), sampled=False)
    assert (rate.runs, rate.trips, rate.hours) == (1, 1, 0.5)


def test_axes_are_parameters_of_channels_with_several_values() -> None:
    rows = [row(value, "none") for value in (0.0, 0.1)]
    rows[0]["point"]["ego_speed"] = 20.0
    rows[1]["point"]["ego_speed"] = 30.0
    assert debounce_axes(figures_of(rows)) == [CONFIRM]
    assert debounce_axes(figures_of(rows[:1])) == []
