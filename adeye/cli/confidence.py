"""``confidence``: what a campaign allows to say about the probability of a violation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from adeye.cli.completion import complete_campaigns
from adeye.cli.options import Db, Json
from adeye.cli.output import NONE, clean, emit, emit_json, emit_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.report.claims import Claim, Claims

Name = Annotated[
    str | None,
    typer.Argument(
        metavar="[ODD|CAMPAIGN]",
        help="An ODD's file or id, or a campaign by number or digest; default: the latest.",
        autocompletion=complete_campaigns,
    ),
]
Level = Annotated[
    float,
    typer.Option(
        "--level",
        metavar="SHARE",
        envvar="ADEYE_LEVEL",
        help="Confidence of each statement.",
    ),
]
WithMethod = Annotated[
    str,
    typer.Option(
        "--method",
        metavar="METHOD",
        envvar="ADEYE_METHOD",
        help="Of the two-sided interval: clopper-pearson (exact), wilson, jeffreys. The one-sided "
        "bound is always exact.",
    ),
]
Target = Annotated[
    float | None,
    typer.Option(
        "--target",
        metavar="SHARE",
        envvar="ADEYE_TARGET",
        help="Bound that is wanted; tells how many points without a failure it takes.",
    ),
]
Joint = Annotated[
    bool,
    typer.Option("--joint", envvar="ADEYE_JOINT", help="Make all bounds hold at once."),
]


def confidence(
    name: Name = None,
    *,
    level: Level = 0.95,
    method: WithMethod = "clopper-pearson",
    target: Target = None,
    joint: Joint = False,
    db: Db = None,
    json: Json = False,
) -> None:
    """Bound the probability that an FSR is violated, where the design allows it.

    Only points that were drawn at random from a declared distribution allow a probability; for
    every other design the reason is given. Ends with 3 if nothing may be said about a mandatory
    FSR of the gate.
    """
    from typing import cast

    from adeye.evaluation.verdict import ExitCode
    from adeye.report.claims import ClaimOptions, Method
    from adeye.reporting import claim

    options = ClaimOptions(level, cast("Method", method), target, joint)
    claims = claim(db, name, options)
    if json:
        emit_json("confidence", claims.model_dump(mode="json"))
    else:
        print_claims(claims)
    if claims.missing or not claims.claims:
        raise typer.Exit(ExitCode.INCOMPLETE)


def print_claims(claims: Claims) -> None:
    """Print the bounds of each architecture, then what cannot be said, then the conditions."""
    from adeye.report.refusals import refusals_of
    from adeye.report.words import counted

    percent = f"{100.0 * claims.level:g} %"
    for architecture in dict.fromkeys(item.architecture for item in claims.claims):
        said = [
            item for item in claims.claims if item.architecture == architecture and not item.refusal
        ]
        if said:
            _print_said(architecture, said, percent, claims.target)
    for refusal in refusals_of(claims):
        places = ", ".join(refusal.scenarios) or "all scenarios"
        emit(
            clean(f"No statement about {places} ({counted(refusal.count)} of FSR × architecture):")
        )
        emit(clean(f"  {refusal.reason}."))
        if not refusal.is_all:
            emit(clean(f"  {', '.join(refusal.fsrs)}"))
    if not claims.claims:
        emit("No FSR is judged on any test case of the campaign.")
    if claims.conditions:
        emit("")
        for name in dict.fromkeys(
            item.scenario for item in claims.claims if item.scenario and not item.refusal
        ):
            emit(clean(f"{name}: {claims.populations[name]}."))
        for text in claims.conditions:
            emit(clean(text))


def _print_said(
    architecture: str, said: Sequence[Claim], percent: str, target: float | None
) -> None:
    from adeye.report.words import counted, number

    headers = ["FSR", "Scenario", "Points", "Exercised", "Failing", "Undecided", "Share"]
    headers += [f"Interval {percent}", f"At most ({percent})", "Per hour"]
    wanted = [f"Needed for {number(target)}"] if target is not None else []
    rows = []
    for item in said:
        cells = [item.fsr, item.scenario or "by exposure", counted(item.points)]
        cells += [counted(item.exercised), counted(item.failing), counted(item.undecided)]
        cells.append(NONE if item.share is None else number(item.share))
        cells.append(
            NONE
            if item.interval is None
            else f"[{number(item.interval.low)}, {number(item.interval.high)}]"
        )
        upper = NONE if item.upper is None else number(item.upper)
        if item.upper_varied is not None:
            upper += f" ({number(item.upper_varied.low)} to {number(item.upper_varied.high)})"
        cells.append(upper)
        cells.append(NONE if item.rate_per_h is None else number(item.rate_per_h))
        if wanted:
            cells.append(NONE if item.needed is None else counted(item.needed))
        rows.append(cells)
    title = architecture + (" (gate)" if said[0].is_in_gate else "")
    emit_table(headers + wanted, rows, title=title, right=(headers + wanted)[2:])
