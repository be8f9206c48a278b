"""Findings as SARIF: every rule, every finding with its place."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from adeye.errors import SourceLocation
from adeye.report.formats.sarif import check_sarif
from adeye.store.read.checking import Checked, Violation
from adeye.store.rules import RULES

PLACE = SourceLocation("odd/concepts/a.yaml", 12, 5)


def checked(*findings: Violation) -> Checked:
    return Checked("a", Path("odd/a.yaml"), None, RULES, findings)


def test_finding_points_at_its_line() -> None:
    log = check_sarif(checked(Violation("asil_lost", "fsr", "FSR-1", "has ASIL B", PLACE)))
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
    log = check_sarif(checked(Violation("not_run", "scenario", "cut_in", "x", None)))
    (result,) = log["runs"][0]["results"]
    (place,) = result["locations"]
    assert place["logicalLocations"] == [{"fullyQualifiedName": "scenario/cut_in"}]
    assert place["physicalLocation"]["artifactLocation"]["uri"] == "odd/a.yaml"
    assert place["physicalLocation"]["region"]["startLine"] == 1


def test_finding_of_a_stored_campaign_stands_at_the_file_that_it_was_planned_from() -> None:
    campaign: Any = SimpleNamespace(provenance={"odd_path": "../odd/gone.yaml"})
    found = Violation("not_run", "scenario", "cut_in", "x", None)
    log = check_sarif(Checked("a", None, campaign, RULES, (found,)))
    (result,) = log["runs"][0]["results"]
    uri = result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
    assert not uri.startswith(("/", ".."))
    assert uri.endswith("odd/gone.yaml")


def test_nothing_found_is_a_log_with_every_rule_and_no_result() -> None:
    log = check_sarif(checked())
    assert log["version"] == "2.1.0"
    assert log["runs"][0]["results"] == []
    assert [rule["id"] for rule in log["runs"][0]["tool"]["driver"]["rules"]] == [
        rule.name for rule in RULES
    ]
    assert json.loads(json.dumps(log)) == log
