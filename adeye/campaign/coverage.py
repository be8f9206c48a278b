"""What the plan of an ODD covers of it, and what the runs of a campaign do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from adeye.campaign.plan import make_plan
from adeye.errors import SpecError
from adeye.store.covered import coverage_of_runs, executed_runs
from adeye.store.repository import Repository
from adeye.sweep.bins import bins_of
from adeye.sweep.coverage import Coverage, Situations, coverage_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from adeye.sweep.expand import Expansion

_CHUNK: Final = 65_536
"""Test cases that are looked at together."""


@dataclass(frozen=True)
class CoverageTable:
    """What is covered, and of what.

    Attributes:
        odd: Id of the ODD.
        campaign: Id of the campaign; None for a plan.
        planned: Test cases.
        counted: Those that count: planned inside the ODD, and of a campaign with a result.
        outside_odd: Those whose planned attributes lie outside the ODD.
        without_result: Planned ones that were not executed; none of a plan.
        not_judged: Runs in which the scenario did not come about, or that could not be executed.
        coverage: The combinations.
    """

    odd: str
    campaign: str | None
    planned: int
    counted: int
    outside_odd: int
    without_result: int
    not_judged: int
    coverage: Coverage


def planned_coverage(path: Path, strength: int) -> CoverageTable:
    """Count what the test cases of an ODD would cover. Nothing is executed.

    Args:
        path: The ODD's file.
        strength: Most attributes that are combined.

    Raises:
        InputError: Anything is wrong with the ODD.
    """
    plan = make_plan(path)
    odd = plan.files.odd.spec
    for name, own in bins_of(odd.attributes, odd.coverage).items():
        if not own:
            raise SpecError(
                f"coverage.{name}: no bin lies within the attributes of the ODD",
                where=plan.files.odd.locate(("coverage", name)),
                remedy="Give edges on both sides of its limit.",
            )
    found = coverage_of(odd.attributes, odd.coverage, strength, _planned(plan.expansion))
    count = plan.expansion.count
    outside = count - found.situations
    return CoverageTable(odd.odd, None, count, found.situations, outside, 0, 0, found)


def executed_coverage(db: str | Path | None, campaign: str | None, strength: int) -> CoverageTable:
    """Count what the runs of a campaign that have a result cover of its ODD.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        campaign: Number or id; None for the newest.
        strength: Most attributes that are combined.

    Raises:
        InputError: There is no such campaign.
    """
    with Repository.open(db, create=False) as repository:
        info = repository.find_campaign(campaign)
        odd = repository.content("odd", info.odd_digest)["odd"]
        runs = executed_runs(repository.location, info.id)
    found = coverage_of_runs(runs, odd, strength)
    return CoverageTable(
        info.odd,
        info.id,
        runs.planned,
        found.situations,
        runs.outside_odd,
        runs.without_result,
        runs.not_judged,
        found,
    )


def _planned(expansion: Expansion) -> Iterator[Situations]:
    for part in expansion.columns(size=_CHUNK):
        rows = part.points[part.is_inside[part.points]]
        columns: dict[str, Any] = dict(part.shared.parameters)
        for axis in part.section.group.axes:
            if axis.kind == "parameter":
                columns[axis.name] = part.section.group.points.column(axis.name, part.rows[rows])
        yield Situations(part.shared.scenario, columns, len(rows))
