"""Verdicts as SARIF: what does not pass, at its line."""

from __future__ import annotations

import json
from typing import Any

import pytest

from adeye.judge.verdict import Verdict
from adeye.report.formats.sarif import judged_in, render_sarif, verdict_sarif
from adeye.report.model.part import Place
from adeye.report.model.report import Report
from adeye.store.read.totals import ChannelFailure
from tests.report.formats.test_sarif import require_sarif
from tests.stored import known


def results(report: Report) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = verdict_sarif(report)["runs"][0]["results"]
    return found


def of(report: Report, name: str) -> dict[str, Any]:
    """Find a result by FSR, architecture and scenario."""
    for item in results(report):
        if item["locations"][0]["logicalLocations"][0]["fullyQualifiedName"] == name:
            return item
    raise LookupError(name)


def test_log_has_the_shape_of_the_format_and_every_fsr_as_a_rule(report: Report) -> None:
    log = json.loads(render_sarif(report))
    require_sarif(log)
    rules = log["runs"][0]["tool"]["driver"]["rules"]
    assert [rule["id"] for rule in rules] == [item.id for item in report.fsrs]
    assert rules[0]["properties"]["asil"] == "D"


def test_every_cell_that_does_not_pass_is_a_result_and_no_other(report: Report) -> None:
    expected = {
        (fsr.id, architecture.id, scenario.id)
        for fsr in report.fsrs
        for architecture in report.architectures
        for scenario in judged_in(report, fsr)
        for cell in [report.cell(fsr.id, architecture.id, scenario.id)]
        if cell is None or cell.verdict is not Verdict.PASS
    }
    found = {
        (item["ruleId"], item["properties"]["architecture"], item["properties"]["scenario"])
        for item in results(report)
        if item["properties"]["scenario"]
    }
    assert found == expected != set()


def test_failure_stands_at_the_scenario_with_the_fsr_beside_it(report: Report) -> None:
    item = of(report, "FSR-02/legacy_camera/cut_in")
    place = item["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == "odd/motorway.yaml"
    assert place["region"]["startLine"] == 9
    (related,) = item["relatedLocations"]
    assert related["physicalLocation"]["region"]["startLine"] == 60
    cell = known(report.cell("FSR-02", "legacy_camera", "cut_in"))
    for word in (str(cell.worst_run), cell.command):
        assert word in item["message"]["text"]


def test_only_mandatory_fsrs_of_the_gate_are_errors(report: Report) -> None:
    assert of(report, "FSR-02/legacy_camera/cut_in")["level"] == "warning"
    gate = report.architectures[0].model_copy(update={"is_gate": True})
    changed = report.model_copy(update={"architectures": (gate, *report.architectures[1:])})
    assert of(changed, "FSR-02/legacy_camera/cut_in")["level"] == "error"
    assert of(changed, "FSR-07/legacy_camera/cut_in")["level"] == "warning"


def test_scenario_that_does_not_exercise_a_passing_fsr_is_not_applicable(report: Report) -> None:
    item = of(report, "FSR-03/camera_radar/lead_braking")
    assert (item["kind"], item["level"]) == ("notApplicable", "none")


def test_fsr_without_any_red_scenario_that_does_not_pass_is_told_at_its_own_line(
    report: Report,
) -> None:
    few = {"verdict": Verdict.VACUOUS, "exercised": 2, "min_exercised": 30}
    cells = tuple(
        cell.model_copy(update={**few, "counts": {Verdict.VACUOUS: cell.runs}})
        if (cell.fsr, cell.architecture, cell.scenario) == ("FSR-01", "camera_radar", None)
        else cell
        for cell in report.cells
    )
    item = of(report.model_copy(update={"cells": cells}), "FSR-01/camera_radar/all scenarios")
    assert item["level"] == "error"
    assert item["locations"][0]["physicalLocation"]["region"]["startLine"] == 60
    assert "exercised in 2 of 30 needed runs." in item["message"]["text"]


def test_fingerprint_does_not_change_with_campaign_run_or_verdict(report: Report) -> None:
    cells = tuple(
        cell.model_copy(update={"worst_run": "other"}) if cell.worst_run else cell
        for cell in report.cells
    )
    other = report.model_copy(update={"campaign": "c-other", "cells": cells})
    prints = [[item["partialFingerprints"] for item in results(each)] for each in (report, other)]
    assert prints[0] == prints[1]
    assert len({str(item) for item in prints[0]}) == len(prints[0])


def test_result_without_a_line_stands_at_the_odds_file(report: Report) -> None:
    bare = {
        name: tuple(item.model_copy(update={"where": None}) for item in getattr(report, name))
        for name in ("scenarios", "fsrs")
    }
    where = Place(path="odd/motorway.yaml", line=1, column=1)
    gone = report.model_copy(update={"where": where, **bare})
    places = [item["locations"][0]["physicalLocation"] for item in results(gone)]
    assert {place["artifactLocation"]["uri"] for place in places} == {"odd/motorway.yaml"}
    assert {place["region"]["startLine"] for place in places} == {1}


@pytest.mark.parametrize(("refused", "level"), [(2, "error"), (0, "note")])
def test_channel_that_failed_is_a_result(report: Report, refused: int, level: str) -> None:
    failure = ChannelFailure(
        "camera_radar", "nominal", "channel_error", 2, refused, "KeyError: 1 (own.py:7)", 0, "why"
    )
    log = verdict_sarif(report.model_copy(update={"channel_failures": (failure,)}))
    assert log["runs"][0]["tool"]["driver"]["rules"][-1]["id"] == "channel_error"
    item = log["runs"][0]["results"][-1]
    assert (item["ruleId"], item["level"]) == ("channel_error", level)
    for word in ("nominal in 2 runs of camera_radar", "KeyError: 1 (own.py:7)"):
        assert word in item["message"]["text"]
