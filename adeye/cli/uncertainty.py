"""``uncertainty``: what halving the step changes, and what verdicts are judged with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from adeye.cli.completion import complete_campaigns
from adeye.cli.options import Db, Json
from adeye.cli.output import emit, emit_json, emit_table, plain, short

if TYPE_CHECKING:
    from adeye.campaign.uncertainty import UncertaintyTable
    from adeye.store.halving import UncertaintyRecord

What = Annotated[
    str | None,
    typer.Argument(
        metavar="[CAMPAIGN|ODD]",
        help="Number of the campaign or beginning of its digest, or an ODD's file or id, of which "
        "the newest campaign counts; default: the latest campaign.",
        autocompletion=complete_campaigns,
    ),
]


def uncertainty(what: What = None, db: Db = None, json: Json = False) -> None:
    """Show what halving the step changes in margins and metrics: the numeric uncertainty.

    It is the 95th percentile of the differences between runs and their twins with half the step,
    the largest of fewer than 20, and none of fewer than 10 pairs with two values. A margin that
    holds by less is INCONCLUSIVE. An ODD asks for it with `uncertainty: {situations: 20}`.

    Exit codes: 0 done, 2 the campaign did not ask for it, or has not come so far.
    """
    from adeye.campaign.uncertainty import uncertainty_table

    found = uncertainty_table(db, what)
    if json:
        emit_json("uncertainty", _document(found))
        return
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
