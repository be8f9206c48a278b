"""JUnit read back by its schema: what is red, and nothing is skipped."""

from pathlib import Path
from typing import Any

import pytest
from lxml import etree

from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.formats.junit import render_junit
from adeye.report.model.report import Cell, Report
from adeye.store.read.totals import ChannelFailure
from tests.report.fake import build_report
from tests.report.parts import impact
from tests.stored import known

SCHEMA = etree.XMLSchema(etree.parse(Path(__file__).with_name("JUnit.xsd")))


@pytest.fixture
def report(report: Report) -> Report:
    """Return a report that compares with no baseline."""
    return report.model_copy(update={"impact": None})


def parse(report: Report) -> Any:
    document = etree.fromstring(render_junit(report))
    SCHEMA.assertValid(document)
    return document


def with_gate(report: Report, architecture: str, code: ExitCode) -> Report:
    """Put another architecture into the gate."""
    architectures = tuple(
        item.model_copy(update={"is_gate": item.id == architecture})
        for item in report.architectures
    )
    return report.model_copy(
        update={"architectures": architectures, "exit_code": code, "message": "not all pass"}
    )


def with_cell(report: Report, wanted: tuple[str, str, str | None], cell: Cell | None) -> Report:
    cells = [c for c in report.cells if (c.fsr, c.architecture, c.scenario) != wanted]
    extra = [] if cell is None else [cell]
    return report.model_copy(update={"cells": (*cells, *extra)})


def results(document: Any) -> dict[tuple[str, str], str]:
    """Map class and name of each test case to ``failure``, ``error`` or ``passed``."""
    return {
        (case.get("classname"), case.get("name")): case[0].tag if len(case) else "passed"
        for case in document.iter("testcase")
    }


def test_green_gate_has_no_red_case_though_others_fail(report: Report) -> None:
    document = parse(report)
    assert set(results(document).values()) == {"passed"}
    assert {suite.get("name") for suite in document} == {
        *("campaign", "camera_radar", "legacy_camera", "lidar")
    }
    legacy = document.xpath("testsuite[@name='legacy_camera']")[0]
    assert legacy.get("tests") == "0"
    assert "FSR-02 (mandatory): FAIL" in legacy.findtext("system-out")
    assert legacy.xpath("properties/property[@name='verdict.FSR-02']/@value") == ["FAIL"]


def test_fail_is_a_failure_with_binding_and_command(report: Report) -> None:
    document = parse(with_gate(report, "legacy_camera", ExitCode.FAILED))
    found = results(document)
    assert found["legacy_camera.cut_in", "FSR-02"] == "failure"
    assert found["legacy_camera.lead_braking", "FSR-02"] == "passed"
    assert found["campaign", "exit_code"] == "failure"
    place = "//testcase[@classname='legacy_camera.cut_in'][@name='FSR-02']/failure"
    failure = document.xpath(place)[0]
    assert failure.get("type") == "FAIL"
    assert "required_deceleration is 6.91 m/s² at 4.35 s, short by 0.91 m/s²" in failure.text
    assert "reproduce: adeye replay r101b7e04c19" in failure.text


def test_cases_of_an_architecture_stand_in_the_order_of_the_table_of_verdicts(
    report: Report,
) -> None:
    document = parse(with_gate(report, "lidar", ExitCode.INCOMPLETE))
    names = document.xpath("testsuite[@name='lidar']/testcase/@name")
    # An error, an invalid and an inconclusive one; what passes as the concept has it.
    assert list(dict.fromkeys(names)) == [
        *("FSR-06", "FSR-02", "FSR-04"),
        *("FSR-01", "FSR-03", "FSR-05"),
    ]


def test_state_that_is_neither_pass_nor_fail_is_an_error(report: Report) -> None:
    document = parse(with_gate(report, "lidar", ExitCode.INCOMPLETE))
    for fsr, verdict in (("FSR-02", "INVALID"), ("FSR-04", "INCONCLUSIVE"), ("FSR-06", "ERROR")):
        kinds = document.xpath(f"//testcase[@name='{fsr}']/error/@type")
        assert kinds.count(verdict) == 1


def test_failure_is_counted_once_and_its_total_stands_in_the_output(report: Report) -> None:
    document = parse(with_gate(report, "legacy_camera", ExitCode.FAILED))
    names = [case.getparent().get("classname") for case in document.iter("failure")]
    fsr = document.xpath("//testcase[@name='FSR-02'][failure]/@classname")
    assert fsr == ["legacy_camera.cut_in", "legacy_camera.cut_out_to_stopped"]
    assert "legacy_camera" not in names
    out = document.xpath("testsuite[@name='legacy_camera']")[0].findtext("system-out")
    assert "FSR-02 over all scenarios: FAIL, exercised in 180 of 180 runs" in out


def test_total_that_no_scenario_is_red_for_is_a_case_of_its_own(report: Report) -> None:
    overall = known(report.cell("FSR-01", "camera_radar"))
    failed = overall.model_copy(update={"verdict": Verdict.INCONCLUSIVE})
    document = parse(
        with_cell(report, ("FSR-01", "camera_radar", None), failed).model_copy(
            update={"exit_code": ExitCode.INCOMPLETE}
        )
    )
    assert results(document)["camera_radar", "FSR-01"] == "error"


def test_nothing_is_skipped_and_counts_of_a_suite_are_those_of_its_cases(report: Report) -> None:
    for architecture in ("camera_radar", "legacy_camera", "lidar"):
        document = parse(with_gate(report, architecture, ExitCode.FAILED))
        assert list(document.iter("skipped")) == []
        assert not document.xpath("//@skipped")
        for suite in document:
            assert int(suite.get("tests")) == len(suite.findall("testcase"))
            assert int(suite.get("failures")) == len(suite.findall("testcase/failure"))
            assert int(suite.get("errors")) == len(suite.findall("testcase/error"))


def test_vacuous_scenario_is_neutral_while_the_fsr_passes(report: Report) -> None:
    cell = known(report.cell("FSR-03", "camera_radar", "lead_braking"))
    assert cell.verdict is Verdict.VACUOUS
    document = parse(report)
    assert results(document)["camera_radar.lead_braking", "FSR-03"] == "passed"
    out = document.xpath("testsuite[@name='camera_radar']")[0].findtext("system-out")
    assert "not exercised: FSR-03 in lead_braking" in out


def waived(report: Report) -> Report:
    """A report in which INCONCLUSIVE in one scenario is waived, so that FSR-01 passes over all."""
    open_ = {Verdict.INCONCLUSIVE: 1, Verdict.PASS: 59}
    overall = known(report.cell("FSR-01", "camera_radar"))
    passes = {"counts": {Verdict.INCONCLUSIVE: 1, Verdict.PASS: overall.runs - 1}}
    part = known(report.cell("FSR-01", "camera_radar", "cut_in"))
    changed = part.model_copy(update={"verdict": Verdict.INCONCLUSIVE, "counts": open_})
    total = with_cell(report, ("FSR-01", "camera_radar", None), overall.model_copy(update=passes))
    return with_cell(total, ("FSR-01", "camera_radar", "cut_in"), changed)


def test_waived_scenario_is_neutral_while_the_fsr_passes_and_red_once_it_does_not(
    report: Report,
) -> None:
    passing = waived(report)
    document = parse(passing)
    assert results(document)["camera_radar.cut_in", "FSR-01"] == "passed"
    out = document.xpath("testsuite[@name='camera_radar']")[0].findtext("system-out")
    assert "waived: FSR-01 in cut_in" in out
    overall = known(passing.cell("FSR-01", "camera_radar"))
    expired = overall.model_copy(update={"verdict": Verdict.INCONCLUSIVE})
    changed = with_cell(passing, ("FSR-01", "camera_radar", None), expired)
    red = parse(changed.model_copy(update={"exit_code": ExitCode.INCOMPLETE}))
    assert results(red)["camera_radar.cut_in", "FSR-01"] == "error"


def test_vacuous_fsr_is_an_error_where_it_is_vacuous_and_says_how_many_runs_are_needed(
    report: Report,
) -> None:
    overall = known(report.cell("FSR-03", "camera_radar"))
    few = {"verdict": Verdict.VACUOUS, "exercised": 2, "min_exercised": 30}
    vacuous = overall.model_copy(update=few)
    changed = with_cell(report, ("FSR-03", "camera_radar", None), vacuous)
    document = parse(changed.model_copy(update={"exit_code": ExitCode.INCOMPLETE}))
    found = results(document)
    assert ("camera_radar", "FSR-03") not in found
    assert found["camera_radar.lead_braking", "FSR-03"] == "error"
    out = document.xpath("testsuite[@name='camera_radar']")[0].findtext("system-out")
    assert "FSR-03 over all scenarios: VACUOUS, exercised in 2 of 30 needed runs" in out


def test_missing_cell_is_an_error(report: Report) -> None:
    for scenario, name in ((None, "camera_radar"), ("cut_in", "camera_radar.cut_in")):
        document = parse(with_cell(report, ("FSR-01", "camera_radar", scenario), None))
        assert results(document)[name, "FSR-01"] == "error"


def test_fsr_that_is_not_applicable_is_an_error(report: Report) -> None:
    cell = Cell(fsr="FSR-01", architecture="camera_radar", verdict=None, command="adeye show")
    document = parse(with_cell(report, ("FSR-01", "camera_radar", None), cell))
    place = "//testcase[@classname='camera_radar'][@name='FSR-01']/error/@type"
    assert document.xpath(place) == ["NOT_APPLICABLE"]


def test_fsr_that_is_not_mandatory_is_no_test_case(report: Report) -> None:
    document = parse(with_gate(report, "legacy_camera", ExitCode.FAILED))
    assert "FSR-07" not in {name for _, name in results(document)}
    out = document.xpath("testsuite[@name='legacy_camera']")[0].findtext("system-out")
    assert "not mandatory: FSR-07: FAIL" in out


def test_scenario_outside_the_scope_of_an_fsr_is_no_test_case(report: Report) -> None:
    fsrs = tuple(fsr.model_copy(update={"scenarios": ("cut_in",)}) for fsr in report.fsrs)
    found = results(parse(report.model_copy(update={"fsrs": fsrs})))
    assert ("camera_radar.cut_in", "FSR-01") in found
    assert ("camera_radar.lead_braking", "FSR-01") not in found


def test_unaccounted_test_case_and_an_empty_plan_are_errors(report: Report) -> None:
    for counts in ({"accounted": 539}, {"planned": 0, "accounted": 0}):
        changed = {**counts, "exit_code": ExitCode.INCOMPLETE}
        found = results(parse(report.model_copy(update=changed)))
        assert found["campaign", "accounted"] == "error"
        assert found["campaign", "exit_code"] == "error"


def test_control_characters_are_left_out() -> None:
    changed = build_report("\x00\x07\x1b[31m\ufffe]]><x>", rows=4, replays=1)
    document = parse(with_gate(changed, "legacy_camera", ExitCode.FAILED))
    text = document.xpath("//testcase[@name='FSR-02']/failure")[0].text
    assert "[31m]]><x>" in text


def test_time_stamp_is_that_of_the_report(report: Report) -> None:
    document = parse(report.model_copy(update={"created": "2026-03-01T12:00:00"}))
    assert {suite.get("timestamp") for suite in document} == {"2026-03-01T12:00:00"}


def test_failure_names_the_line_of_its_fsr(report: Report) -> None:
    gate = report.architectures[0].model_copy(update={"is_gate": True})
    changed = report.model_copy(update={"architectures": (gate, *report.architectures[1:])})
    text = render_junit(changed).decode()
    assert "requirement: odd/concepts/motorway.yaml:60" in text


@pytest.mark.parametrize("architecture", ["camera_radar", "legacy_camera"])
@pytest.mark.parametrize("refused", [0, 2])
def test_channel_that_failed_is_a_case_of_its_architecture(
    report: Report, architecture: str, refused: int
) -> None:
    detail = "KeyError: 1 (own.py:7)"
    failure = ChannelFailure(architecture, "nominal", "channel_error", 2, refused, detail, 0, "")
    code = ExitCode.INCOMPLETE if refused else ExitCode.OK
    document = parse(report.model_copy(update={"channel_failures": (failure,), "exit_code": code}))
    case = results(document).get((f"{architecture}.channels", "channel nominal"))
    is_gate = architecture == "camera_radar"
    assert case == (("error" if refused else "passed") if is_gate else None)
    suite = document.xpath(f"testsuite[@name='{architecture}']")[0]
    assert f"nominal in 2 runs of {architecture} ({detail})" in suite.findtext("system-out")


@pytest.mark.parametrize("code", [ExitCode.OK, ExitCode.FAILED, ExitCode.INCOMPLETE])
def test_baseline_that_the_report_compares_with_is_red_as_the_gate_is(
    report: Report, code: ExitCode
) -> None:
    found = impact(exit_code=code, message="what the gate says")
    document = parse(report.model_copy(update={"impact": found}))
    kinds = {ExitCode.OK: "passed", ExitCode.FAILED: "failure", ExitCode.INCOMPLETE: "error"}
    told = results(document)
    assert told.pop(("gate", "exit_code")) == kinds[code]
    assert set(told.values()) == {"passed"}
    suite = document.xpath("testsuite[@name='gate']")[0]
    assert all(change.text in suite.findtext("system-out") for change in found.changes)
    assert found.changes


def test_suites_have_different_names(report: Report) -> None:
    text = report.model_dump_json().replace('"camera_radar"', '"campaign"')
    suites = parse(Report.model_validate_json(text)).findall("testsuite")
    names = [suite.get("name") for suite in suites]
    assert {"campaign", "campaign of adeye"} < set(names)
    assert len(set(names)) == len(names)
