"""The SARIF log: what the format asks for beyond its schema."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from adeye.errors import SourceLocation
from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.formats import sarif
from adeye.report.model.part import Place
from adeye.report.model.report import Cell, Report
from adeye.store.read.checking import Checked, Violation
from adeye.store.read.totals import ChannelFailure
from adeye.store.rules import RULES
from tests.stored import known

PLACE = SourceLocation("odd/a.yaml", 3, 5)
RULE = sarif.SarifRule("R1", "Something holds.", "Make it hold.")


@pytest.fixture
def report(report: Report) -> Report:
    """The report, compared with no baseline."""
    return report.model_copy(update={"impact": None})


def require_sarif(log: dict[str, Any]) -> None:
    """Hold every index of a log against what it points at, and every level against its kind."""
    for run in log["runs"]:
        rules = run["tool"]["driver"]["rules"]
        assert len({rule["id"] for rule in rules}) == len(rules)
        for item in run["results"]:
            assert rules[item["ruleIndex"]]["id"] == item["ruleId"]
            # Of the kinds only fail has a level (SARIF 2.1.0, 3.27.10).
            assert (item["level"] == "none") == (item.get("kind", "fail") != "fail")


def result(**changes: Any) -> sarif.SarifResult:
    fields: dict[str, Any] = {"rule": "R1", "text": "x", "name": "a/b", "where": PLACE}
    return sarif.SarifResult(**(fields | changes))


def log_of(*found: sarif.SarifResult) -> dict[str, Any]:
    return sarif.sarif_log([RULE], found)


def written(*found: sarif.SarifResult) -> list[dict[str, Any]]:
    results: list[dict[str, Any]] = log_of(*found)["runs"][0]["results"]
    return results


def test_same_key_has_the_same_fingerprint_and_another_another() -> None:
    found = written(result(key=("a",)), result(key=("a",), text="y"), result(key=("b",)))
    first, second, third = (item["partialFingerprints"][sarif.FINGERPRINT] for item in found)
    assert first == second != third


def test_fingerprint_that_hosts_look_at_follows_our_own() -> None:
    found = written(result(key=("a",)), result(key=("b",)))
    own, other = (item["partialFingerprints"] for item in found)
    assert own["primaryLocationLineHash"] == f"{own[sarif.FINGERPRINT][:16]}:1"
    assert own["primaryLocationLineHash"] != other["primaryLocationLineHash"]


def test_places_are_uris_relative_to_a_root_that_is_declared() -> None:
    (run,) = log_of(result(where=SourceLocation("my odd/ä#1.yaml", 1, 1)))["runs"]
    place = run["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]
    assert place["uriBaseId"] in run["originalUriBaseIds"]
    assert place["uri"] == "my%20odd/%C3%A4%231.yaml"


def test_result_has_no_location_that_a_host_would_refuse_and_no_fingerprint_of_nothing() -> None:
    (only,) = written(result(where=None))
    assert {"locations", "partialFingerprints"}.isdisjoint(only)
    (placed,) = written(result())
    assert "locations" in placed


# --- Findings as SARIF: every rule, every finding with its place ----------------------------------

LINE = SourceLocation("odd/concepts/a.yaml", 12, 5)


def checked(*findings: Violation) -> Checked:
    return Checked("a", Path("odd/a.yaml"), None, RULES, findings)


def test_finding_points_at_its_line() -> None:
    log = sarif.check_sarif(checked(Violation("asil_lost", "fsr", "FSR-1", "has ASIL B", LINE)))
    (run,) = log["runs"]
    (result,) = run["results"]
    assert result["ruleId"] == "asil_lost"
    assert run["tool"]["driver"]["rules"][result["ruleIndex"]]["id"] == "asil_lost"
    assert result["message"] == {"text": "FSR-1: has ASIL B"}
    assert result["locations"] == [
        {
            "logicalLocations": [{"fullyQualifiedName": "fsr/FSR-1"}],
            "physicalLocation": {
                "artifactLocation": {"uri": "odd/concepts/a.yaml", "uriBaseId": "%SRCROOT%"},
                "region": {"startLine": 12, "startColumn": 5},
            },
        }
    ]


def test_finding_without_a_line_stands_at_the_odds_file() -> None:
    log = sarif.check_sarif(checked(Violation("not_run", "scenario", "cut_in", "x", None)))
    (result,) = log["runs"][0]["results"]
    (place,) = result["locations"]
    assert place["logicalLocations"] == [{"fullyQualifiedName": "scenario/cut_in"}]
    assert place["physicalLocation"]["artifactLocation"]["uri"] == "odd/a.yaml"
    assert place["physicalLocation"]["region"]["startLine"] == 1


def test_finding_of_a_stored_campaign_stands_at_the_file_that_it_was_planned_from() -> None:
    campaign: Any = SimpleNamespace(provenance={"odd_path": "../odd/gone.yaml"})
    found = Violation("not_run", "scenario", "cut_in", "x", None)
    log = sarif.check_sarif(Checked("a", None, campaign, RULES, (found,)))
    (result,) = log["runs"][0]["results"]
    uri = result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
    assert not uri.startswith(("/", ".."))
    assert uri.endswith("odd/gone.yaml")


def test_nothing_found_is_a_log_with_every_rule_and_no_result() -> None:
    log = sarif.check_sarif(checked())
    assert log["version"] == "2.1.0"
    assert log["runs"][0]["results"] == []
    assert [rule["id"] for rule in log["runs"][0]["tool"]["driver"]["rules"]] == [
        rule.name for rule in RULES
    ]
    assert json.loads(json.dumps(log)) == log


# --- Verdicts as SARIF: what does not pass, at its line -------------------------------------------


def results(report: Report) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = sarif.verdict_sarif(report)["runs"][0]["results"]
    return found


def of(report: Report, name: str) -> dict[str, Any]:
    """Find a result by FSR, architecture and scenario."""
    for item in results(report):
        if item["locations"][0]["logicalLocations"][0]["fullyQualifiedName"] == name:
            return item
    raise LookupError(name)


def test_log_has_the_shape_of_the_format_and_every_fsr_as_a_rule(report: Report) -> None:
    log = json.loads(sarif.render_sarif(report))
    require_sarif(log)
    rules = log["runs"][0]["tool"]["driver"]["rules"]
    assert [rule["id"] for rule in rules] == [item.id for item in report.fsrs]
    assert rules[0]["properties"]["asil"] == "D"


def test_every_cell_that_does_not_pass_is_a_result_and_no_other(report: Report) -> None:
    expected = {
        (fsr.id, architecture.id, scenario.id)
        for fsr in report.fsrs
        for architecture in report.architectures
        for scenario in sarif.judged_in(report, fsr)
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


def test_results_stand_in_the_order_of_the_table_of_verdicts(report: Report) -> None:
    found = [(item["properties"]["architecture"], item["ruleId"]) for item in results(report)]
    # Of the gate first; of each architecture the worst, and what is not mandatory last.
    assert list(dict.fromkeys(found)) == [
        ("camera_radar", "FSR-03"),
        ("camera_radar", "FSR-04"),
        *(("legacy_camera", f"FSR-0{number}") for number in (1, 2, 3, 4, 7)),
        *(("lidar", f"FSR-0{number}") for number in (6, 2, 4, 3)),
    ]


def test_only_mandatory_fsrs_of_the_gate_are_errors(report: Report) -> None:
    assert of(report, "FSR-02/legacy_camera/cut_in")["level"] == "warning"
    gate = report.architectures[0].model_copy(update={"is_gate": True})
    changed = report.model_copy(update={"architectures": (gate, *report.architectures[1:])})
    assert of(changed, "FSR-02/legacy_camera/cut_in")["level"] == "error"
    assert of(changed, "FSR-07/legacy_camera/cut_in")["level"] == "warning"


def test_fsr_that_cannot_be_judged_is_not_applicable_in_each_scenario(report: Report) -> None:
    pair = "FSR-01", "camera_radar"
    cell = Cell(fsr=pair[0], architecture=pair[1], verdict=None, command="adeye show", note="why")
    others = [item for item in report.cells if (item.fsr, item.architecture) != pair]
    found = of(report.model_copy(update={"cells": (*others, cell)}), "/".join((*pair, "cut_in")))
    assert found["properties"]["verdict"] == "NOT_APPLICABLE"
    assert "why" in found["message"]["text"]
    assert "no result is recorded" not in found["message"]["text"]


def test_scenario_that_does_not_exercise_a_passing_fsr_is_not_applicable(report: Report) -> None:
    item = of(report, "FSR-03/camera_radar/lead_braking")
    assert (item["kind"], item["level"]) == ("notApplicable", "none")


def test_scenario_that_a_waiver_accepts_is_not_applicable_while_the_fsr_passes(
    report: Report,
) -> None:
    def told(overall: Verdict) -> str:
        runs = {None: overall, "cut_in": Verdict.INCONCLUSIVE}
        cells = tuple(
            cell.model_copy(
                update={
                    "verdict": runs[cell.scenario],
                    "counts": {Verdict.INCONCLUSIVE: 1, Verdict.PASS: cell.runs - 1},
                }
            )
            if (cell.fsr, cell.architecture) == ("FSR-01", "camera_radar") and cell.scenario in runs
            else cell
            for cell in report.cells
        )
        changed = report.model_copy(update={"cells": cells})
        return str(of(changed, "FSR-01/camera_radar/cut_in")["level"])

    assert told(Verdict.PASS) == "none"
    assert told(Verdict.INCONCLUSIVE) == "error"


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
    log = sarif.verdict_sarif(report.model_copy(update={"channel_failures": (failure,)}))
    assert log["runs"][0]["tool"]["driver"]["rules"][-1]["id"] == "channel_error"
    item = log["runs"][0]["results"][-1]
    assert (item["ruleId"], item["level"]) == ("channel_error", level)
    for word in ("nominal in 2 runs of camera_radar", "KeyError: 1 (own.py:7)"):
        assert word in item["message"]["text"]


def test_contacts_of_a_green_campaign_are_told(report: Report) -> None:
    gate = next(item.id for item in report.architectures if item.is_gate)
    found = results(report.model_copy(update={"contacts": {gate: 2}}))
    (item,) = [each for each in found if each["ruleId"] == "contact"]
    assert (item["level"], item["message"]["text"]) == ("note", f"Contact in 2 runs of {gate}.")
    assert all(each["ruleId"] != "contact" for each in results(report))


def test_gate_that_refuses_is_a_result_where_nothing_else_says_so(report: Report) -> None:
    passing = tuple(
        cell.model_copy(update={"verdict": Verdict.PASS, "is_set_aside": False})
        for cell in report.cells
    )
    bare: dict[str, Any] = {"cells": passing, "channel_failures": ()}
    assert results(report.model_copy(update=bare)) == []
    refused = {"exit_code": ExitCode.INCOMPLETE, "message": "a twin was withdrawn"}
    (item,) = results(report.model_copy(update={**bare, **refused}))
    assert (item["ruleId"], item["level"]) == ("gate", "error")
    assert item["message"]["text"] == "The gate answers 3: a twin was withdrawn."
