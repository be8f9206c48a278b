"""``preventability``: would a reference driver have avoided what the architecture did not?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli.options import Db, Json, Quiet
from adeye.cli.output import clean, emit, emit_json, emit_table, plain, short
from adeye.cli.progress import watching
from adeye.cli.reference import EditionName, names_in

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.campaign.preventability import Preventability
    from adeye.evaluation.preventability import Cell

SHOWN: Final = 20
"""Findings that are listed; JSON has all."""

_WORDS: Final[Mapping[Cell, str]] = {
    "both_avoid": "Both avoid",
    "only_ours": "Only ours",
    "only_model": "Only the model",
    "neither": "Neither",
    "unknown": "Unknown",
}

Name = Annotated[
    str | None,
    typer.Argument(
        metavar="RUN|CAMPAIGN",
        help="Campaign by id, its beginning or its number, or the beginning of a run's digest; "
        "the newest campaign by default.",
    ),
]
Models = Annotated[
    str,
    typer.Option(
        "--model",
        metavar="NAMES",
        envvar="ADEYE_MODELS",
        help="Reference drivers, with commas between: cc, fsm, rss, reg157.",
    ),
]
Threshold = Annotated[
    str | None,
    typer.Option(
        "--threshold",
        metavar="DECELERATION",
        envvar="ADEYE_THRESHOLD",
        help="Required deceleration, such as '4 m/s^2', beyond which a run without a contact has a "
        "conflict; by default the full braking of the model.",
    ),
]
Everything = Annotated[
    bool,
    typer.Option(
        "--all",
        envvar="ADEYE_ALL",
        help="Drive the situation of every run, also where nothing happened.",
    ),
]
Workers = Annotated[
    int,
    typer.Option(
        "--workers",
        min=1,
        max=64,
        metavar="N",
        envvar="ADEYE_WORKERS",
        help="Batches that are executed at once.",
    ),
]


def preventability(
    name: Name = None,
    *,
    model: Models = "cc",
    edition: EditionName = "r157-01",
    threshold: Threshold = None,
    everything: Everything = False,
    workers: Workers = 1,
    db: Db = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Let reference drivers of UN R157 drive the conflicts of a campaign, and say who avoids them.

    A conflict is a contact, or a required deceleration beyond the threshold. The driver has the
    same vehicle in the same situation, sees it as it is, and has no faults, since it has no such
    parts. What only the model avoids is a finding. A benchmark, not a proof.

    Exit codes: 0 done, also with findings; 2 no such run, campaign, model or edition; 4 a result
    contradicts the database.
    """
    from adeye.campaign.preventability import prevent
    from adeye.units import Dimension, parse_quantity

    limit = None if threshold is None else parse_quantity(threshold, Dimension.ACCELERATION)
    with watching(quiet=quiet) as report:
        found = prevent(
            db,
            name,
            models=names_in(model),
            edition=edition,
            threshold=limit,
            everything=everything,
            workers=workers,
            report=report,
        )
    if json:
        emit_json("preventability", {"edition": edition, **plain(found)})
        return
    _print(found)


def _print(found: Preventability) -> None:
    for model, count in found.looked_at.items():
        what = f" (contact, or more than {found.threshold_mps2[model]:.2f} m/s² required)"
        emit(
            f"Campaign {short(found.campaign)}: {count} of {found.executed} runs driven by {model}"
            f"{'' if found.is_everything else what}, without faults"
        )
    if not found.comparisons:
        emit("No conflict: there is nothing to drive.")
        return
    headers = ("Scenario", "Architecture", "Model", *_WORDS.values())
    rows = [
        [row.scenario, row.architecture, row.model, *(row.counts[cell] for cell in _WORDS)]
        for row in found.rows
    ]
    emit("")
    emit_table(headers, rows, right=headers[3:])
    _print_findings(found)
    emit("\nA benchmark, not a proof: what no model avoids may still be avoidable.")


def _print_findings(found: Preventability) -> None:
    findings = [item for item in found.comparisons if item.cell == "only_model"]
    if not findings:
        emit("\nNo finding: no model avoids a contact that an architecture does not.")
        return
    emit(f"\n{len(findings)} findings, avoided by the model only:")
    headers = ("Run", "Scenario", "Architecture", "Fault entry", "Model", "Impact [m/s]", "Drive")
    emit_table(
        headers,
        [
            [
                short(item.run),
                item.scenario,
                item.architecture,
                item.fault_entry,
                item.model,
                "" if item.impact_speed_mps is None else f"{item.impact_speed_mps:.2f}",
                short(item.drive),
            ]
            for item in findings[:SHOWN]
        ],
        right=("Impact [m/s]",),
    )
    if len(findings) > SHOWN:
        emit(f"and {len(findings) - SHOWN} more; --json lists all.")
    first = findings[0]
    emit(
        f"See {clean(first.model)} beside {clean(first.architecture)}:\n"
        f"  adeye replay {short(first.run)} --html run.html\n"
        f"  adeye replay {short(first.drive)} --html drive.html"
    )
