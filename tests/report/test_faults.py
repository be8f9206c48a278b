"""What a report tells of the faults of the mini campaign, before and after they are measured."""

from __future__ import annotations

import json
import shutil
from typing import TYPE_CHECKING

import pytest
from lxml import html as lxml_html

from adeye.campaign.studies.fault_timing import campaign_injections
from adeye.campaign.studies.forks import look_back
from adeye.judge.preventability import TAKEOVER_CLASSES
from adeye.judge.timeline import CLASSES
from adeye.report.formats.json import parse_json, render_json
from adeye.report.page.html import render
from tests.report.pages import built, section

if TYPE_CHECKING:
    from adeye.report.model.assessment import FaultEvidence
    from adeye.report.model.report import Report
    from tests.project import Executed


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


def test_takeovers_are_counted_and_the_wrong_ones_listed(measured: Report) -> None:
    found = told(measured).takeovers
    assert found is not None
    assert tuple(found.counts) == TAKEOVER_CLASSES
    assert found.runs == told(measured).executed == 28
    assert {item.class_ for item in found.listed} == {"missed"}
    assert len(found.listed) == found.counts["missed"]


def test_runs_without_a_fault_have_a_rate_and_an_availability(measured: Report) -> None:
    calm = told(measured).calm
    assert [item.architecture for item in calm] == ["camera_radar", "legacy_camera"]
    for item in calm:
        assert item.rate.runs == 6
        assert item.rate.per_hour == item.rate.trips / item.rate.hours
        assert item.availability is not None
        assert 0.9 < item.availability <= 1.0
        assert item.rate.low is None


def test_json_has_the_same(measured: Report) -> None:
    text = render_json(measured)
    assert json.loads(text)["faults"]["measured"] == 16
    assert told(parse_json(text)) == told(measured)


def test_page_has_a_bar_for_every_group(measured: Report) -> None:
    tree = lxml_html.document_fromstring(render(measured))
    rows = tree.xpath("//table[contains(@class, 'timing')]/tbody/tr")
    assert len(rows) == len(told(measured).groups)
    runs = {str(run) for run in tree.xpath("//table[contains(@class, 'timing')]//@data-run")}
    assert runs == {group.worst.run for group in told(measured).groups}


@pytest.mark.slow
def test_runs_that_depend_on_the_machine_are_counted_at_the_top(plain: Report) -> None:
    assert plain.machine_dependent == 0
    assert "wall-clock" not in render(plain)
    page = render(plain.model_copy(update={"machine_dependent": 3}))
    [summary] = lxml_html.document_fromstring(page).xpath("//section[@id='summary']")
    assert "3 runs depend on the machine" in " ".join(summary.text_content().split())
