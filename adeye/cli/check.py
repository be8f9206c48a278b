"""``check``: whether concept, plan and evidence fit together."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli.completion import complete_campaigns
from adeye.cli.options import Db, Json
from adeye.cli.output import clean, emit, emit_json, short, talk, wrote
from adeye.cli.writing import named

if TYPE_CHECKING:
    from adeye.store.checking import Checked, CheckFinding

_FOUND: Final = 1
_NOTHING: Final = 3

Subject = Annotated[
    str | None,
    typer.Argument(
        metavar="[ODD|CAMPAIGN]",
        help="An ODD's file; or number or beginning of the digest of a campaign, by default the "
        "latest.",
        autocompletion=complete_campaigns,
    ),
]
SarifFile = Annotated[
    Path | None,
    typer.Option(
        "--sarif",
        metavar="FILE",
        envvar="ADEYE_SARIF",
        callback=named,
        help="Write the findings as SARIF, which code hosts show beside the lines.",
    ),
]


def check(
    subject: Subject = None, *, db: Db = None, sarif: SarifFile = None, json: Json = False
) -> None:
    """Check that concept, plan and evidence fit together. Nothing is executed.

    Each rule is an SQL view, v_check_<rule>, that is empty when all is well: safety goals without a
    requirement, an ASIL that was lost, illegal decompositions, common causes without a record of
    the dependent-failure analysis, hazards without a scenario, time budgets above the FTTI, what
    expired, evidence that is vacuous, stale or incomplete. Of an ODD the files are checked with the
    newest evidence of it in the database; of a campaign what is stored.

    Exit codes: 0 no findings, 1 findings, 2 input error, 3 nothing to check, 5 database or disk.
    """
    from adeye.campaign.integrity import check_odd, check_stored

    if subject is not None and _is_file(subject):
        checked: Checked | None = check_odd(subject, db)
    else:
        checked = check_stored(db, subject)
    if checked is None:
        talk("Nothing to check: the database has no campaign. Name an ODD, or run one first.")
        raise typer.Exit(_NOTHING)
    if sarif is not None:
        _write_sarif(checked, sarif)
    if json:
        emit_json("check", _document(checked))
    else:
        _print(checked)
    if sarif is not None:
        wrote(sarif)
    if checked.findings:
        raise typer.Exit(_FOUND)


def _is_file(subject: str) -> bool:
    return subject.endswith((".yaml", ".yml")) or "/" in subject


def _write_sarif(checked: Checked, path: Path) -> None:
    from json import dumps

    from adeye.outputs import write_atomically
    from adeye.report.check_sarif import check_sarif

    write_atomically((dumps(check_sarif(checked), indent=1) + "\n").encode(), path)


def _print(checked: Checked) -> None:
    for rule, findings in checked.broken.items():
        emit(f"\n{rule.name}: {rule.text}")
        for finding in findings:
            emit(f"  {clean(_line(finding))}")
        emit(f"  {rule.remedy}")
    count, broken = len(checked.findings), len(checked.broken)
    what = f"{checked.odd}{_evidence(checked)}"
    if count:
        findings_word = "1 finding" if count == 1 else f"{count} findings"
        emit(f"\n{clean(what)}: {findings_word} by {broken} of {len(checked.rules)} rules.")
    else:
        emit(clean(f"{what}: no findings by {len(checked.rules)} rules."))


def _evidence(checked: Checked) -> str:
    if checked.campaign is None:
        return " (no campaign of it is stored, so its evidence is not checked)"
    return f", campaign {checked.campaign.number} ({short(checked.campaign.id)})"


def _line(finding: CheckFinding) -> str:
    place = f"{finding.where}: " if finding.where is not None else ""
    return f"{place}{finding.id}: {finding.detail}"


def _document(checked: Checked) -> dict[str, object]:
    remedies = {rule.name: rule.remedy for rule in checked.rules}
    campaign = checked.campaign
    return {
        "odd": checked.odd,
        "path": checked.path,
        "campaign": None if campaign is None else campaign.id,
        "rules": [
            {"id": rule.name, "view": rule.view or None, "text": rule.text, "remedy": rule.remedy}
            for rule in checked.rules
        ],
        "findings": [
            {
                "rule": item.rule,
                "part": item.part,
                "id": item.id,
                "detail": item.detail,
                "where": item.where,
                "remedy": remedies[item.rule],
            }
            for item in checked.findings
        ],
    }
