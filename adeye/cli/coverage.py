"""``coverage``: which attributes of an ODD, and which together, its test cases have."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli.options import Db, Json
from adeye.cli.output import NONE, clean, emit, emit_json, emit_table, short

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.campaign.coverage import CoverageTable
    from adeye.sweep.coverage import Combination

OddOrCampaign = Annotated[
    str | None,
    typer.Argument(
        metavar="[ODD|CAMPAIGN]",
        help="An ODD's file, or number of a campaign or beginning of its digest; default: the "
        "latest campaign.",
    ),
]
Strength = Annotated[
    int,
    typer.Option(
        "--strength",
        min=1,
        max=3,
        metavar="N",
        envvar="ADEYE_STRENGTH",
        help="Most attributes that are looked at together.",
    ),
]
_LISTED: Final = 20
"""Uncovered combinations that are listed; all of them are in the JSON document."""
_WORDS: Final = {1: "bins", 2: "pairs", 3: "triples"}


def coverage(
    of: OddOrCampaign = None, strength: Strength = 2, db: Db = None, json: Json = False
) -> None:
    """Count which attributes of an ODD its test cases have, one by one and together.

    Of an ODD's file the planned test cases count, of a campaign those that were executed. What no
    scenario of the ODD can have is not asked for, but counted. Coverage says what was looked at,
    not how it went and not how often it happens on the road.
    """
    from adeye.campaign.coverage import executed_coverage, planned_coverage

    if of is not None and (of.endswith((".yaml", ".yml")) or Path(of).is_file()):
        found = planned_coverage(Path(of), strength)
    else:
        found = executed_coverage(db, of, strength)
    if json:
        emit_json("coverage", {"table": found})
        return
    _print(found)


def _print(found: CoverageTable) -> None:
    if found.campaign is None:
        emit(clean(f"ODD {found.odd}: {found.counted} of {found.planned} planned test cases count"))
    else:
        emit(
            clean(
                f"Campaign {short(found.campaign)} of {found.odd}: {found.counted} of "
                f"{found.planned} test cases count"
            )
        )
    for count, why in (
        (found.without_result, "without a result"),
        (found.not_judged, "in which the scenario did not come about"),
        (found.outside_odd, "outside the ODD"),
        (found.coverage.outside, "with an attribute in no bin, counted for the others only"),
    ):
        if count:
            emit(f"  {count} {why}")
    parts = found.coverage.combinations
    emit("")
    emit_table(
        ("Attribute", "Covered", "Uncovered", "No scenario can have"),
        [_row(item) for item in parts if len(item.attributes) == 1],
    )
    for size in range(2, found.coverage.strength + 1):
        _print_together([item for item in parts if len(item.attributes) == size], size)


def _row(item: Combination) -> list[str]:
    return [
        item.attributes[0],
        _labels([labels for labels, _ in item.counts]),
        _labels(item.uncovered),
        _labels(item.impossible),
    ]


def _labels(bins: Sequence[tuple[str, ...]]) -> str:
    return ", ".join(clean(" × ".join(labels)) for labels in bins) or NONE


def _print_together(parts: Sequence[Combination], size: int) -> None:
    word = _WORDS[size]
    feasible = sum(item.feasible for item in parts)
    covered = sum(item.covered for item in parts)
    total = sum(item.total for item in parts)
    share = f" ({covered / feasible:.1%})" if feasible else ""
    emit(
        f"\n{covered} of {feasible} feasible {word} are covered{share}; {total - feasible} of "
        f"{total} {word} no scenario can have"
    )
    uncovered = [
        [", ".join(item.attributes), " × ".join(labels)]
        for item in parts
        for labels in item.uncovered
    ]
    if uncovered:
        emit("")
        emit_table(("Attributes", "Uncovered"), uncovered[:_LISTED])
    if len(uncovered) > _LISTED:
        emit(f"and {len(uncovered) - _LISTED} more; --json lists all")
