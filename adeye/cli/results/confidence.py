"""``confidence|uncertainty``: how probable a violation may be, and what the step does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, cast

import typer

from adeye.cli.options import Db, Json, OddOrCampaign, complete_campaigns, option
from adeye.cli.output import (
    NONE,
    emit,
    emit_found,
    emit_line,
    emit_table,
    listed,
    plain,
    short,
    talk,
)
from adeye.judge.verdict import ExitCode
from adeye.report.words import counted, number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.campaign.studies.half_step import UncertaintyTable
    from adeye.report.claims import Claim, Claims
    from adeye.store.write.half_steps import UncertaintyRecord

# --- ``confidence``: what a campaign allows to say about the probability of a violation -----------


def confidence(
    name: OddOrCampaign = None,
    *,
    level: Annotated[float, option("SHARE")] = 0.95,
    method: Annotated[str, option("METHOD")] = "clopper-pearson",
    target: Annotated[float | None, option("SHARE")] = None,
    joint: bool = False,
    db: Db = None,
    json: Json = False,
) -> None:
    """Bound the probability that an FSR is violated, where the design allows it.

    Only points that were drawn at random from a declared distribution allow a probability; for
    every other design the reason is given. Ends with 3 if nothing may be said about a mandatory
    FSR of the gate.

    Parameters:
        name: An ODD's file or id, or a campaign by number or digest; default: the latest.
        level: Confidence of each statement.
        method: Of the two-sided interval: clopper-pearson (exact), wilson, jeffreys. The one-sided
            bound is always exact.
        target: Bound that is wanted; tells how many points without a failure it takes.
        joint: Make all bounds hold at once.

    Examples:
        adeye confidence odd/motorway_chauffeur.yaml
        adeye confidence 3 --level 0.99 --target 1e-3
    """
    from adeye.answers import claim
    from adeye.report.claims import ClaimOptions, Method

    options = ClaimOptions(level, cast("Method", method), target, joint)
    claims = claim(db, name, options)
    emit_found("confidence", claims, print_claims, json=json)
    if claims.missing:
        told = listed(f"{fsr} for {architecture}" for fsr, architecture in claims.missing)
        talk(f"note: nothing can be said about what the gate needs: {told}")
    if claims.missing or not claims.claims:
        raise typer.Exit(ExitCode.INCOMPLETE)


def print_claims(claims: Claims) -> None:
    """Print the bounds of each architecture, then what cannot be said, then the conditions."""
    from adeye.report.claims import refusals_of

    percent = f"{100.0 * claims.level:g} %"
    for architecture in dict.fromkeys(item.architecture for item in claims.claims):
        said = [
            item for item in claims.claims if item.architecture == architecture and not item.refusal
        ]
        if said:
            _print_said(architecture, said, percent, claims.target)
    for refusal in refusals_of(claims):
        places = ", ".join(refusal.scenarios) or "all scenarios"
        emit_line(f"No statement about {places} ({counted(refusal.count)} of FSR × architecture):")
        emit_line(f"  {refusal.reason}.")
        if not refusal.is_all:
            emit_line(f"  {', '.join(refusal.fsrs)}")
    if not claims.claims:
        emit("No FSR is judged on any test case of the campaign.")
    if claims.conditions:
        emit("")
        for name in dict.fromkeys(
            item.scenario for item in claims.claims if item.scenario and not item.refusal
        ):
            emit_line(f"{name}: {claims.populations[name]}.")
        for text in claims.conditions:
            emit_line(text)


def _print_said(
    architecture: str, said: Sequence[Claim], percent: str, target: float | None
) -> None:

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


# --- ``uncertainty``: what halving the step changes, and what verdicts are judged with ------------

What = Annotated[
    str | None,
    typer.Argument(
        metavar="[CAMPAIGN|ODD]",
        autocompletion=complete_campaigns,
        help="Number of the campaign or beginning of its digest, or an ODD's file or id, of which "
        "the newest campaign counts; default: the latest campaign.",
    ),
]


def uncertainty(what: What = None, db: Db = None, json: Json = False) -> None:
    """Show what halving the step changes in margins and metrics: the numeric uncertainty.

    It is the 95th percentile of the differences between runs and their twins with half the step,
    the largest of fewer than 20, and none of fewer than 10 pairs with two values. A margin that
    holds by less is INCONCLUSIVE. An ODD asks for it with `uncertainty: {situations: 20}`.

    Exit codes: 0 done, 2 the campaign did not ask for it, or has not come so far.

    Examples:
        adeye uncertainty
        adeye uncertainty odd/motorway_chauffeur.yaml --json
    """
    from adeye.campaign.studies.half_step import uncertainty_table

    found = uncertainty_table(db, what)
    emit_found("uncertainty", found, _print, json=json, document=_document)


def _print(found: UncertaintyTable) -> None:
    emit(f"Campaign {short(found.campaign)} of {found.odd}: step {found.step_s:g} s against half")
    for kind, title in (("fsr", "Margin of FSR"), ("metric", "Metric")):
        lines = [item for item in found.lines if item.difference.kind == kind]
        shown = [item for item in lines if item.difference.pairs or item.difference.differing]
        rows = [_row(item) for item in shown]
        headers = ("Scenario", "Architecture", title, "Unit", "Pairs", "Uncertainty", "Largest")
        emit("")
        emit_table((*headers, "Changes"), rows, right=headers[4:])
        if len(lines) > len(shown):
            emit(f"{len(lines) - len(shown)} more have no value in any pair; --json lists them.")


def _row(item: UncertaintyRecord) -> list[object]:
    found = item.difference
    value = "too few" if found.uncertainty is None else f"{found.uncertainty:.3g}"
    return [
        item.scenario,
        item.architecture,
        found.name,
        found.unit,
        f"{found.pairs} of {found.sampled}",
        value,
        "" if found.largest is None else f"{found.largest:.3g}",
        ", ".join(f"{count} {change}" for change, count in found.changes.items()),
    ]


def _document(found: UncertaintyTable) -> dict[str, object]:
    lines = [
        {
            "scenario": item.scenario,
            "architecture": item.architecture,
            **plain(item.difference),
            "uncertainty": item.difference.uncertainty,
        }
        for item in found.lines
    ]
    return {"campaign": found.campaign, "odd": found.odd, "step_s": found.step_s, "lines": lines}
