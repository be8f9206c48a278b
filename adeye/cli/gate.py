"""``gate|stale|check``: judge a campaign; which evidence is stale; do files hold together."""

from __future__ import annotations

import shlex
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli import options as opt
from adeye.cli import output as out
from adeye.errors import InputError, UsageError, amount
from adeye.judge.verdict import ExitCode
from adeye.outputs import write_atomically

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.campaign.stale import Staleness
    from adeye.report.gate.baseline import Finding
    from adeye.report.gate.decide import GateResult
    from adeye.store.read.checking import Checked

# --- ``gate``: judge a stored campaign, alone or against a committed baseline ---------------------


def gate(
    campaign: opt.OddOrCampaign = None,
    *,
    baseline: Annotated[
        Path | None, opt.option("FILE", env="GATE_BASELINE", callback=opt.given)
    ] = None,
    tolerance: Annotated[list[str] | None, opt.option("NAME=SIZE")] = None,
    update: Annotated[bool, opt.option(env="UPDATE_BASELINE")] = False,
    accept_incomplete: bool = False,
    junit: opt.JunitFile = None,
    db: opt.Db = None,
    json: opt.Json = False,
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
    from adeye.answers import gate_campaign
    from adeye.report.gate.changes import Tolerances
    from adeye.report.gate.decide import GateOptions

    opt.require_baseline_named(baseline, "ADEYE_GATE_BASELINE")
    if (update or accept_incomplete or tolerance) and baseline is None:
        raise UsageError(
            "--update, --accept-incomplete and --tolerance are about a baseline",
            remedy="Name its file with --baseline.",
        )
    if accept_incomplete and not update:
        raise UsageError("--accept-incomplete is about writing a baseline", remedy="Add --update.")
    options = GateOptions(
        baseline=baseline,
        tolerances=Tolerances.given(
            opt.sizes_of(tolerance or (), "tolerance", "FSR-02=0.1 or m=0.05")
        ),
        is_update=update,
        accepts_incomplete=accept_incomplete,
        junit=junit,
    )
    result = gate_campaign(db, campaign, options)
    out.emit_found("gate", result, print_gate, json=json, document=_gate_document)
    if junit is not None:
        out.wrote(junit)
    if result.is_written and baseline is not None:
        out.wrote(baseline)
    raise typer.Exit(int(result.exit_code))


def print_gate(result: GateResult) -> None:
    """Print what was found, what decides first, and the answer."""
    from adeye.report.gate.baseline import deciding

    against = f" against {result.baseline}" if result.baseline else ""
    state = result.state
    out.emit_line(
        f"Campaign {result.number} of {state.odd} ({out.short(result.campaign)}), "
        f"{amount(state.planned, 'test case')}{against}."
    )
    decides = deciding(result.findings)
    others = [item for item in result.findings if item not in decides]
    _print_findings("Decides:", decides)
    _print_findings("Does not decide:", others)
    if result.baseline and not result.changes and not result.is_written:
        out.emit("Nothing differs from the baseline.")
    out.emit_prose(out.clean(result.message))


def _print_findings(title: str, findings: Sequence[Finding]) -> None:
    if findings:
        out.emit(title)
    for item in findings:
        out.emit_prose(out.clean(f"  {item}"))
        if item.runs:
            out.emit_line(f"    adeye show {out.short(item.runs[0])}")


def _gate_document(result: GateResult) -> dict[str, object]:
    from adeye.report.gate.baseline import deciding

    decides = deciding(result.findings)
    return {
        **out.fields_of(result, "campaign", "number"),
        "odd": result.state.odd,
        "state": result.work,
        **out.fields_of(result.state, "planned", "accounted", "gate"),
        "baseline": result.baseline or None,
        "is_written": result.is_written,
        "exit_code": int(result.exit_code),
        **out.fields_of(result, "message", "contacts", "channel_failures"),
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
    db: opt.Db = None,
    backend: opt.Backend = "batch",
    variant: opt.Variant = None,
    exit_code: bool = False,
    json: opt.Json = False,
) -> None:
    """Say which evidence of the newest campaign no longer counts, and why.

    Evidence is a run with a verdict of an FSR. It goes stale when a file is edited on which the run
    or the verdict depends: a scenario, the executable part of an architecture, a fault, a threshold
    or a formula, the attributes of the ODD, the code of a plug-in. Titles, texts and costs make
    nothing stale. Nothing is executed or saved.

    Exit codes: 0 done, whatever is stale, or with --exit-code only if nothing is; 2 input error,
    3 with --exit-code: something is stale or missing; 4 the evidence is not as it was written, or
    came out otherwise for a certificate; 5 database or disk.

    Parameters:
        odd: The ODD's file; default: that of the newest campaign.
        exit_code: End with 3 if a verdict is stale, or the files ask for one that is not there.

    Examples:
        adeye stale
        adeye stale odd/first.yaml --exit-code
        adeye stale odd/first.yaml --json
    """
    from adeye.campaign.stale import find_stale
    from adeye.spec.load import odd_asked_about
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        plan = None if odd is None else opt.plan_of(odd, backend, variant)
        name = None if plan is None else plan.files.odd.spec.odd
        campaign = repository.latest_campaign(name)
        if campaign is None:
            what = "the database has no campaign" if name is None else f"no campaign of ODD {name}"
            raise InputError(what, remedy="Run an ODD first: adeye run ODD")
        later = [item.provenance for item in repository.evidence.sessions(campaign.id)]
        near = repository.location.beside.parent
        path = odd or odd_asked_about(campaign.provenance, near, later)
        if plan is None:
            if not path.is_file():
                raise InputError(
                    f"the ODD of campaign {campaign.number} is no longer at {path}",
                    remedy="Name its file: adeye stale ODD",
                )
            plan = opt.plan_of(path, backend, variant)
        repository.require_sound(campaign.id)
        found = find_stale(repository, plan, campaign)
        otherwise = repository.uncertified(campaign.id)
    shown = partial(_print_stale, odd=path, db=db)
    out.emit_found("stale", found, shown, json=json, document=_stale_document)
    if otherwise:
        out.talk(out.clean(f"The gate answers 4: {otherwise}"))
        raise typer.Exit(ExitCode.INTEGRITY)
    if exit_code and not found.is_complete:
        raise typer.Exit(ExitCode.INCOMPLETE)


_STALE: Final = ("cause", "subject", "text", "evidence", "runs", "fsrs", "architectures")


def _stale_document(found: Staleness) -> dict[str, object]:
    return {
        **out.fields_of(found, "campaign", "number", "odd", "evidence", "counts"),
        "stale": [out.fields_of(item, *_STALE) for item in found.stale],
        "now": {
            "evidence": found.planned,
            **out.fields_of(found, "there", "to_judge", "to_replay", "to_execute"),
        },
    }


def _print_stale(found: Staleness, odd: Path, db: str | None) -> None:
    from adeye.store.location import option

    out.emit(
        f"Campaign {found.number} ({out.clean(found.odd)}): {found.counts:,} of {found.evidence:,} "
        "verdicts still count."
    )
    if found.stale:
        out.emit("")
        out.emit_records(
            found.stale,
            {
                "Verdicts": lambda item: f"{item.evidence:,}",
                "Runs": lambda item: f"{item.runs:,}",
                "FSRs": lambda item: ", ".join(item.fsrs),
                "Why": "text",
            },
            right=("Verdicts", "Runs"),
        )
    name = f"{shlex.quote(str(odd))}{option(db)}"
    needs = [
        (found.to_judge, "to judge again", f"adeye judge {name}"),
        (found.to_replay, "to execute again and judge", f"adeye judge {name} --replay"),
        (found.to_execute, "to execute", f"adeye run {name}"),
    ]
    there = amount(found.there, "is", "are")
    out.emit("")
    out.emit_line(f"{odd} asks for {amount(found.planned, 'verdict')}; {there} there.")
    for count, what, command in needs:
        if count:
            out.emit_line(f"{amount(count, 'run')} {what}: {command}")


# --- ``check``: whether concept, plan and evidence fit together -----------------------------------


def check(
    subject: opt.OddOrCampaign = None,
    *,
    db: opt.Db = None,
    sarif: Annotated[Path | None, opt.option("FILE", callback=opt.named)] = None,
    json: opt.Json = False,
) -> None:
    """Check that concept, plan and evidence fit together. Nothing is executed.

    Each rule is an SQL view, v_check_<rule>, that is empty when all is well: safety goals without a
    requirement, an ASIL that was lost, illegal decompositions, common causes without a record of
    the dependent-failure analysis, hazards without a scenario, time budgets above the FTTI, what
    expired, evidence that is vacuous, stale or incomplete. Of an ODD the files are checked with the
    newest evidence of it in the database; of a campaign what is stored.

    Exit codes: 0 no findings, 1 findings, 2 input error, 3 nothing to check, 4 the evidence
    is not as it was written, 5 database or disk.

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

    if subject is not None and (subject.endswith((".yaml", ".yml")) or "/" in subject):
        checked: Checked | None = check_odd(subject, db)
    else:
        checked = check_stored(db, subject)
    if checked is None:
        out.talk("Nothing to check: the database has no campaign. Name an ODD, or run one first.")
        raise typer.Exit(ExitCode.INCOMPLETE)
    if sarif is not None:
        from json import dumps

        from adeye.report.formats.sarif import check_sarif

        write_atomically((dumps(check_sarif(checked), indent=1) + "\n").encode(), sarif)
    out.emit_found("check", checked, _print_check, json=json, document=_check_document)
    if sarif is not None:
        out.wrote(sarif)
    if checked.findings:
        raise typer.Exit(ExitCode.FAILED)


def _print_check(checked: Checked) -> None:
    for rule, findings in checked.broken.items():
        out.emit(f"\n{rule.name}: {rule.text}")
        for finding in findings:
            place = f"{finding.where}: " if finding.where is not None else ""
            out.emit_line(f"  {place}{finding.id}: {finding.detail}")
        out.emit(f"  {rule.remedy}")
    count, broken = len(checked.findings), len(checked.broken)
    what = f"{checked.odd}{_evidence(checked)}"
    if count:
        out.emit(
            f"\n{out.clean(what)}: {amount(count, 'finding')} by {broken} "
            f"of {len(checked.rules)} rules."
        )
    else:
        out.emit_line(f"{what}: no findings by {len(checked.rules)} rules.")


def _evidence(checked: Checked) -> str:
    if checked.campaign is None:
        return " (no campaign of it is stored, so its evidence is not checked)"
    return f", campaign {checked.campaign.number} ({out.short(checked.campaign.id)})"


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
            {**out.plain(item), "remedy": remedies[item.rule]} for item in checked.findings
        ],
    }
