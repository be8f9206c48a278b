"""What the campaign says of preventability, timing and safe stops."""

import json
import shutil

import pytest
from lxml import html as lxml_html

from adeye.campaign.studies.fault_timing import campaign_injections
from adeye.campaign.studies.preventability import prevent
from adeye.judge.preventability import Cell, Comparison
from adeye.judge.verdict import Verdict
from adeye.report.assessment import LISTED, preventability_of
from adeye.report.formats.json import parse_json, render_json
from adeye.report.model.assessment import Assessment
from adeye.report.model.report import Report
from adeye.report.page.html import render
from tests.project import Executed
from tests.report.pages import built, section
from tests.report.parts import impact


def told(report: Report) -> Assessment:
    assert report.assessment is not None
    return report.assessment


@pytest.fixture(scope="module")
def measured(mini: Executed, tmp_path_factory: pytest.TempPathFactory) -> Report:
    db = shutil.copyfile(mini.db, tmp_path_factory.mktemp("measured") / "adeye.db")
    campaign_injections(db)
    prevent(db)
    return built(db)


def test_what_was_not_evaluated_is_said_with_its_command(plain: Report) -> None:
    found = told(plain).preventability
    assert (found.compared, found.open_contacts, found.findings) == (0, 6, 0)
    text = section(plain, "preventability")
    assert "Nothing was evaluated" in text
    assert f"adeye preventability {plain.campaign[:10]} --db my.db" in text
    assert "No finding" not in text
    assert "None:" not in text


def test_contacts_that_the_model_avoids_are_findings(measured: Report) -> None:
    found = told(measured).preventability
    assert (found.compared, found.open_contacts, found.findings) == (6, 0, 6)
    assert {item.architecture for item in found.listed} == {"legacy_camera"}
    speeds = [item.impact_speed_mps or 0.0 for item in found.listed]
    assert speeds == sorted(speeds, reverse=True)
    tree = lxml_html.document_fromstring(render(measured))
    commands = tree.xpath("//section[@id='preventability']//button/@data-command")
    for item in found.listed:
        assert item.command == f"adeye replay {item.run[:12]} --db my.db"
        assert {item.command, item.drive_command} <= set(map(str, commands))


def test_timing_that_was_not_measured_is_never_green(plain: Report) -> None:
    found = told(plain).timing
    assert len(found.faults) == 4
    assert {row.verdict for row in found.faults} == {Verdict.NOT_RUN}
    assert {row.verdict for row in found.budgets} == {Verdict.NOT_RUN}
    text = section(plain, "timing")
    assert "Not measured: 4 of 4 faults" in text
    assert f"adeye faults {plain.campaign[:10]} --sample 0 --db my.db" in text
    assert "PASS" not in text


def test_silent_channel_is_handled_in_time_and_within_its_budget(measured: Report) -> None:
    found = told(measured).timing
    assert found.assumed_s == 1.0
    rows = {(row.fault_entry, row.architecture): row for row in found.faults}
    silent = rows["nominal_silent", "camera_radar"]
    assert (silent.verdict, silent.handled, silent.runs) == (Verdict.PASS, 4, 4)
    assert silent.margin_s == pytest.approx(1.0 - (silent.fhti_s or 0.0))
    assert rows["nominal_silent", "legacy_camera"].verdict is Verdict.FAIL
    assert rows["front_camera_out", "camera_radar"].verdict is Verdict.INCONCLUSIVE
    budgets = {(row.fsr, row.fault_entry, row.architecture): row for row in found.budgets}
    budget = budgets["FSR-03", "nominal_silent", "camera_radar"]
    assert (budget.fdti_budget_s, budget.verdict, budget.runs) == (0.5, Verdict.PASS, 4)
    assert "Not measured" not in section(measured, "timing")


def test_safe_stops_are_told_without_a_further_measurement(plain: Report) -> None:
    found = told(plain).safe_stops
    assert (found.runs, found.asked, found.unknown) == (28, 4, 0)
    [row] = found.rows
    assert (row.fault_entry, row.architecture) == ("nominal_silent", "camera_radar")
    assert (row.reached, row.verdict) == (4, Verdict.PASS)
    assert "4 of 28 runs asked for one" in section(plain, "safe-stops")


def test_json_has_the_same(measured: Report) -> None:
    text = render_json(measured)
    assert json.loads(text)["assessment"]["preventability"]["findings"] == 6
    assert told(parse_json(text)) == told(measured)
    changed = measured.model_copy(update={"impact": impact()})
    assert parse_json(render_json(changed)).impact == impact()


@pytest.mark.slow
def test_change_is_told_or_its_command(plain: Report) -> None:
    assert plain.impact is None
    text = section(plain, "change")
    assert "written without a baseline" in text
    assert "--baseline reports/baselines/mini.json" in text
    told_of = section(plain.model_copy(update={"impact": impact()}), "change")
    assert "without a baseline" not in told_of
    for word in ("newly failing", "decides", "scenario cut_in has changed", "6 of 10 verdicts"):
        assert word in told_of
    gone = impact(stale=None, not_asked="The ODD is gone.")
    assert "The ODD is gone." in section(plain.model_copy(update={"impact": gone}), "change")


def test_every_section_is_in_the_navigation_and_no_id_is_there_twice(plain: Report) -> None:
    tree = lxml_html.document_fromstring(render(plain))
    linked = set(map(str, tree.xpath("//nav/a/@href")))
    for name in ("preventability", "timing", "safe-stops", "change", "traceability"):
        assert f"#{name}" in linked
        assert len(tree.xpath(f"//section[@id='{name}']")) == 1
    ids = list(map(str, tree.xpath("//@id")))
    assert len(ids) == len(set(ids))
    assert any(name.startswith("gsn-") for name in ids)


@pytest.mark.slow
def test_same_campaign_gives_the_same_page(mini: Executed, plain: Report) -> None:
    assert render(built(mini.db)) == render(plain)


def compared(number: int, cell: Cell, *, edition: str = "r157-01", model: str = "cc") -> Comparison:
    return Comparison(
        run=f"run{number:02}",
        scenario="cut_in",
        architecture="legacy",
        fault_entry="none",
        model=model,
        edition=edition,
        drive=f"drive{number:02}",
        cell=cell,
        impact_speed_mps=float(number),
        drive_impact_speed_mps=None,
    )


COMMANDS = ("adeye preventability c0de", lambda run: f"adeye replay {run}")


def test_hardest_contacts_are_listed_and_all_are_counted() -> None:
    told = preventability_of([], (7, 3), COMMANDS)
    assert (told.executed, told.compared, told.open_contacts) == (7, 0, 3)
    assert (told.tallies, told.findings, told.command) == ((), 0, COMMANDS[0])
    found = [compared(number, "only_model") for number in range(LISTED + 3)]
    told = preventability_of([*found, compared(99, "neither")], (99, 0), COMMANDS)
    assert told.findings == LISTED + 3
    hardest = [f"run{number:02}" for number in range(LISTED + 2, 2, -1)]
    assert [item.run for item in told.listed] == hardest
    assert told.listed[0].drive_command == f"adeye replay drive{LISTED + 2:02}"


def test_run_that_two_models_are_held_against_is_one_and_editions_are_not_counted_together() -> (
    None
):
    found = [compared(1, "neither"), compared(1, "both_avoid", model="fsm")]
    told = preventability_of(found, (1, 0), COMMANDS)
    assert told.compared == 1
    tallies = [(item.model, item.counts["neither"]) for item in told.tallies]
    assert tallies == [("cc", 1), ("fsm", 0)]
    found = [compared(1, "neither"), compared(1, "neither", edition="r157-original")]
    told = preventability_of(found, (1, 0), COMMANDS)
    tallies = [(item.edition, item.runs) for item in told.tallies]
    assert tallies == [("r157-01", 1), ("r157-original", 1)]
