"""Findings of the integrity rules as SARIF."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from adeye.errors import SourceLocation
from adeye.report.places import find_odd
from adeye.report.sarif import SarifResult, SarifRule, sarif_log

if TYPE_CHECKING:
    from adeye.store.checking import Checked


def check_sarif(checked: Checked) -> dict[str, Any]:
    """Write what was found as a SARIF log: every rule that was asked, every finding as an error."""
    path = checked.path
    if path is None and checked.campaign is not None:
        told = checked.campaign.provenance.get("odd_path")
        path = find_odd(str(told)) if told else None
    file = None if path is None else SourceLocation(str(path), 1, 1)
    rules = [SarifRule(rule.name, rule.text, rule.remedy) for rule in checked.rules]
    results = [
        SarifResult(
            rule=finding.rule,
            text=f"{finding.id}: {finding.detail}",
            name=f"{finding.part}/{finding.id}",
            where=finding.where or file,
            key=(checked.odd, finding.rule, finding.part, finding.id, finding.detail),
        )
        for rule in checked.rules
        for finding in checked.findings
        if finding.rule == rule.name
    ]
    return sarif_log(rules, results)
