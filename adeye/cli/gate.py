"""``gate``: judge a stored campaign, alone or against a committed baseline."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from adeye.cli.completion import complete_campaigns
from adeye.cli.options import Db, Json, JunitFile, sizes_of
from adeye.cli.output import clean, emit, emit_json, short, wrote
from adeye.cli.writing import given

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.report.findings import Finding
    from adeye.report.gating import GateResult

Campaign = Annotated[
    str | None,
    typer.Argument(
        metavar="[ODD|CAMPAIGN]",
        help="An ODD's file or id, or a campaign by number or digest; default: the latest.",
        autocompletion=complete_campaigns,
    ),
]
BaselineFile = Annotated[
    Path | None,
    typer.Option(
        "--baseline",
        metavar="FILE",
        envvar="ADEYE_GATE_BASELINE",
        callback=given,
        help="Compare with this file, such as reports/baselines/motorway_chauffeur.json.",
    ),
]
Tolerance = Annotated[
    list[str] | None,
    typer.Option(
        "--tolerance",
        metavar="NAME=SIZE",
        envvar="ADEYE_TOLERANCE",
        help="Loss of margin that does not count, for an FSR or for a unit, such as FSR-02=0.1 or "
        "m=0.05; once for each.",
    ),
]
Update = Annotated[
    bool,
    typer.Option(
        "--update",
        envvar="ADEYE_UPDATE_BASELINE",
        help="Write the campaign as the baseline, and say what changed.",
    ),
]
AcceptIncomplete = Annotated[
    bool,
    typer.Option(
        "--accept-incomplete",
        envvar="ADEYE_ACCEPT_INCOMPLETE",
        help="With --update: write it also if evidence is incomplete.",
    ),
]


def gate(
    campaign: Campaign = None,
    *,
    baseline: BaselineFile = None,
    tolerance: Tolerance = None,
    update: Update = False,
    accept_incomplete: AcceptIncomplete = False,
    junit: JunitFile = None,
    db: Db = None,
    json: Json = False,
) -> None:
    """Judge a campaign that has been run, and exit with the verdict of the gate.

    Nothing is executed. Every stored row is verified first. With a baseline, what fails now, what
    lost margin, and what evidence is missing or not comparable any more decides as well.

    Exit codes: 0 all good, 1 an FSR failed or regressed, 2 input error, 3 evidence incomplete,
    4 integrity violated, 5 database or disk.
    """
    from adeye.errors import UsageError
    from adeye.report.margins import Tolerances
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
        emit_json("gate", _document(result))
    else:
        print_gate(result)
    if junit is not None:
        wrote(junit)
    if result.is_written and baseline is not None:
        wrote(baseline)
    raise typer.Exit(int(result.exit_code))


def print_gate(result: GateResult) -> None:
    """Print what was found, what decides first, and the answer."""
    from adeye.report.findings import deciding
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


def _document(result: GateResult) -> dict[str, object]:
    from adeye.report.findings import deciding

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
