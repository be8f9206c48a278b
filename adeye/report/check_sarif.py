"""Findings of the integrity rules as SARIF, which code hosts show beside the lines of the files.

Source:
    OASIS, Static Analysis Results Interchange Format (SARIF) 2.1.0.
"""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING, Any, Final

from adeye.version import __version__

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.store.checking import Checked, CheckFinding
    from adeye.store.rules import Rule

SCHEMA: Final = "https://json.schemastore.org/sarif-2.1.0.json"


def check_sarif(checked: Checked) -> dict[str, Any]:
    """Write what was found as a SARIF log: every rule that was asked, every finding as an error."""
    results = [
        _result(number, finding)
        for number, rule in enumerate(checked.rules)
        for finding in checked.findings
        if finding.rule == rule.name
    ]
    driver = {"name": "adeye", "version": __version__, "rules": _rules(checked.rules)}
    return {
        "$schema": SCHEMA,
        "version": "2.1.0",
        "runs": [{"tool": {"driver": driver}, "results": results}],
    }


def _rules(rules: Sequence[Rule]) -> list[dict[str, Any]]:
    return [
        {
            "id": rule.name,
            "shortDescription": {"text": rule.text},
            "help": {"text": rule.remedy},
            "defaultConfiguration": {"level": "error"},
        }
        for rule in rules
    ]


def _result(number: int, finding: CheckFinding) -> dict[str, Any]:
    place: dict[str, Any] = {
        "logicalLocations": [{"fullyQualifiedName": f"{finding.part}/{finding.id}"}]
    }
    if finding.where is not None:
        place["physicalLocation"] = {
            "artifactLocation": {"uri": PurePath(finding.where.path).as_posix()},
            "region": {"startLine": finding.where.line, "startColumn": finding.where.column},
        }
    return {
        "ruleId": finding.rule,
        "ruleIndex": number,
        "level": "error",
        "message": {"text": f"{finding.id}: {finding.detail}"},
        "locations": [place],
    }
