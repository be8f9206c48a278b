"""``gate|stale|check``: judge a campaign; which evidence is stale; do files hold together."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli.options import (
    Backend,
    Db,
    Json,
    JunitFile,
    Variant,
    complete_campaigns,
    given,
    named,
    option,
    sizes_of,
)
from adeye.cli.output import clean, emit, emit_json, emit_table, short, talk, wrote

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.campaign.stale import Staleness
    from adeye.report.gate.baseline import Finding
    from adeye.report.gate.decide import GateResult
    from adeye.store.read.checking import Checked, Violation

# --- ``gate``: judge a stored campaign, alone or against a committed baseline ---------------------


def gate(
    campaign: Annotated[
        str | None, typer.Argument(metavar="[ODD|CAMPAIGN]", autocompletion=complete_campaigns)
    ] = None,
    *,
    baseline: Annotated[Path | None, option("FILE", env="GATE_BASELINE", callback=given)] = None,
    tolerance: Annotated[list[str] | None, option("NAME=SIZE")] = None,
    update: Annotated[bool, option(env="UPDATE_BASELINE")] = False,
    accept_incomplete: bool = False,
    junit: JunitFile = None,
    db: Db = None,
    json: Json = False,
) -> None:
    """Judge a campaign that has been run, and exit with the verdict of the gate.

    Nothing is executed. Every stored row is verified first. With a baseline, what fails now, what
    lost margin, and what evidence is missing or not comparable any more decides as well.

    Exit codes: 0 all good, 1 an FSR failed or regressed, 2 input error, 3 evidence incomplete,
    4 integrity violated, 5 database or disk.

    Parameters:
        campaign: An ODD's file or id, or a campaign by number or digest; default: the latest.
        baseline: Compare with this file, such as reports/baselines/motorway_chauffeur.json.
        tolerance: Loss of margin that does not count, for an FSR or for a unit, such as FSR-02=0.1
            or m=0.05; once for each.
        update: Write the campaign as the baseline, and say what changed.
        accept_incomplete: With --update: write it also if evidence is incomplete.

    Examples:
        adeye gate
        adeye gate --baseline reports/baselines/motorway_chauffeur.json --tolerance m=0.05
        adeye gate --baseline reports/baselines/motorway_chauffeur.json --update
    """
    from adeye.errors import UsageError
    from adeye.report.gate.changes import Tolerances
    from adeye.reporting import GateOptions, gate_campaign

    if (update or accept_incomplete or tolerance) and baseline is None:
        raise UsageError(
            "--update, --accept-incomplete and --tolerance are about a baseline",
            remedy="Name its file with --baseline.",
        )
    if accept_incomplete and not update:
        raise UsageError("--accept-incomplete is about writing a baseline", remedy="Add --update.")
    options = GateOptions(
        baseline=baseline,
        tolerances=Tolerances.given(sizes_of(tolerance or (), "tolerance", "FSR-02=0.1 or m=0.05")),
        is_update=update,
        accepts_incomplete=accept_incomplete,
        junit=junit,
    )
    result = gate_campaign(db, campaign, options)
    if json:
        emit_json("gate", _gate_document(result))
    else:
        print_gate(result)
    if junit is not None:
        wrote(junit)
    if result.is_written and baseline is not None:
        wrote(baseline)
    raise typer.Exit(int(result.exit_code))


def print_gate(result: GateResult) -> None:
    """Print what was found, what decides first, and the answer."""
    from adeye.report.gate.baseline import deciding
    from adeye.report.words import counted

    against = f" against {result.baseline}" if result.baseline else ""
    state = result.state
    emit(
        clean(
            f"Campaign {result.number} of {state.odd} ({short(result.campaign)}), "
            f"{counted(state.planned)} test cases{against}."
        )
    )
    decides = deciding(result.findings)
    others = [item for item in result.findings if item not in decides]
    _print_findings("Decides:", decides)
    _print_findings("Does not decide:", others)
    if result.baseline and not result.changes and not result.is_written:
        emit("Nothing differs from the baseline.")
    emit(clean(result.message))


def _print_findings(title: str, findings: Sequence[Finding]) -> None:
    if findings:
        emit(title)
    for item in findings:
        emit(clean(f"  {item}"))
        if item.runs:
            emit(clean(f"    adeye show {short(item.runs[0])}"))


def _gate_document(result: GateResult) -> dict[str, object]:
    from adeye.report.gate.baseline import deciding

    decides = deciding(result.findings)
    return {
        "campaign": result.campaign,
        "number": result.number,
        "odd": result.state.odd,
        "state": result.work,
        "planned": result.state.planned,
        "accounted": result.state.accounted,
        "gate": result.state.gate,
        "baseline": result.baseline or None,
        "is_written": result.is_written,
        "exit_code": int(result.exit_code),
        "message": result.message,
        "contacts": result.contacts,
        "channel_failures": result.channel_failures,
        "findings": [
            {
                "kind": str(item.kind),
                "decides": item in decides,
                "fsr": item.fsr or None,
                "architecture": item.architecture or None,
                "scenario": item.scenario or None,
                "text": item.text,
                "runs": item.runs,
            }
            for item in result.findings
        ],
    }


# --- ``stale``: which evidence no longer counts under the files as they are, and what restores it -


def stale(
    odd: Annotated[Path | None, typer.Argument(metavar="[ODD]", show_default=False)] = None,
    *,
    db: Db = None,
    backend: Backend = "batch",
    variant: Variant = None,
    json: Json = False,
) -> None:
    """Say which evidence of the newest campaign no longer counts, and why.

    Evidence is a run with a verdict of an FSR. It goes stale when a file is edited on which the run
    or the verdict depends: a scenario, the executable part of an architecture, a fault, a threshold
    or a formula, the attributes of the ODD, the code of a plug-in. Titles, texts and costs make
    nothing stale. Nothing is executed or saved.

    Parameters:
        odd: The ODD's file; default: that of the newest campaign.

    Examples:
        adeye stale
        adeye stale odd/first.yaml --json
    """
    from adeye.campaign.plan import make_plan
    from adeye.campaign.stale import find_stale
    from adeye.errors import InputError
    from adeye.spec.load import find_odd
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        plan = None if odd is None else make_plan(odd, backend=backend, variant=variant)
        name = None if plan is None else plan.files.odd.spec.odd
        campaign = repository.latest_campaign(name)
        if campaign is None:
            what = "the database has no campaign" if name is None else f"no campaign of ODD {name}"
            raise InputError(what, remedy="Run an ODD first: adeye run ODD")
        told = str(campaign.provenance.get("odd_path", ""))
        path = odd or find_odd(told, repository.location.beside.parent)
        if plan is None:
            if not path.is_file():
                raise InputError(
                    f"the ODD of campaign {campaign.number} is no longer at {path}",
                    remedy="Name its file: adeye stale ODD",
                )
            plan = make_plan(path, backend=backend, variant=variant)
        found = find_stale(repository, plan, campaign)
    if json:
        emit_json("stale", _stale_document(found))
    else:
        _print_stale(found, path, db)


def _stale_document(found: Staleness) -> dict[str, object]:
    return {
        "campaign": found.campaign,
        "number": found.number,
        "odd": found.odd,
        "evidence": found.evidence,
        "counts": found.counts,
        "stale": [
            {
                "cause": item.cause,
                "subject": item.subject,
                "text": item.text,
                "evidence": item.evidence,
                "runs": item.runs,
                "fsrs": list(item.fsrs),
                "architectures": list(item.architectures),
            }
            for item in found.stale
        ],
        "now": {
            "evidence": found.planned,
            "there": found.there,
            "to_judge": found.to_judge,
            "to_replay": found.to_replay,
            "to_execute": found.to_execute,
        },
    }


def _print_stale(found: Staleness, odd: Path, db: str | None) -> None:
    from adeye.store.location import option

    emit(
        f"Campaign {found.number} ({clean(found.odd)}): {found.counts:,} of {found.evidence:,} "
        "verdicts still count."
    )
    if found.stale:
        rows = [
            [
                f"{item.evidence:,}",
                f"{item.runs:,}",
                clean(", ".join(item.fsrs)),
                clean(item.text),
            ]
            for item in found.stale
        ]
        emit("")
        emit_table(("Verdicts", "Runs", "FSRs", "Why"), rows, right=("Verdicts", "Runs"))
    name = f"{shlex.quote(str(odd))}{option(db)}"
    needs = [
        (found.to_judge, "to judge again", f"adeye judge {name}"),
        (found.to_replay, "to execute again and judge", f"adeye judge {name} --replay"),
        (found.to_execute, "to execute", f"adeye run {name}"),
    ]
    emit(f"\nThe files ask for {found.planned:,} verdicts; {found.there:,} are there.")
    for count, what, command in needs:
        if count:
            emit(clean(f"{count:,} {'run' if count == 1 else 'runs'} {what}: {command}"))


# --- ``check``: whether concept, plan and evidence fit together -----------------------------------

_FOUND: Final = 1
_NOTHING: Final = 3


def check(
    subject: Annotated[
        str | None, typer.Argument(metavar="[ODD|CAMPAIGN]", autocompletion=complete_campaigns)
    ] = None,
    *,
    db: Db = None,
    sarif: Annotated[Path | None, option("FILE", callback=named)] = None,
    json: Json = False,
) -> None:
    """Check that concept, plan and evidence fit together. Nothing is executed.

    Each rule is an SQL view, v_check_<rule>, that is empty when all is well: safety goals without a
    requirement, an ASIL that was lost, illegal decompositions, common causes without a record of
    the dependent-failure analysis, hazards without a scenario, time budgets above the FTTI, what
    expired, evidence that is vacuous, stale or incomplete. Of an ODD the files are checked with the
    newest evidence of it in the database; of a campaign what is stored.

    Exit codes: 0 no findings, 1 findings, 2 input error, 3 nothing to check, 5 database or disk.

    Parameters:
        subject: An ODD's file; or number or beginning of the digest of a campaign, by default the
            latest.
        sarif: Write the findings as SARIF, which code hosts show beside the lines.

    Examples:
        adeye check odd/motorway_chauffeur.yaml
        adeye check
        adeye check 3 --json
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
        emit_json("check", _check_document(checked))
    else:
        _print_check(checked)
    if sarif is not None:
        wrote(sarif)
    if checked.findings:
        raise typer.Exit(_FOUND)


def _is_file(subject: str) -> bool:
    return subject.endswith((".yaml", ".yml")) or "/" in subject


def _write_sarif(checked: Checked, path: Path) -> None:
    from json import dumps

    from adeye.outputs import write_atomically
    from adeye.report.formats.sarif import check_sarif

    write_atomically((dumps(check_sarif(checked), indent=1) + "\n").encode(), path)


def _print_check(checked: Checked) -> None:
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


def _line(finding: Violation) -> str:
    place = f"{finding.where}: " if finding.where is not None else ""
    return f"{place}{finding.id}: {finding.detail}"


def _check_document(checked: Checked) -> dict[str, object]:
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
