"""The situations of the runs of a campaign that have a result, for what they cover of its ODD."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from sqlalchemy import select

from adeye.evaluation.verdict import Outcome
from adeye.spec.bins import CoverageBins
from adeye.spec.odd import Attributes
from adeye.spec.quantity import SI
from adeye.spec.scenario import LogicalScenario
from adeye.store import tables
from adeye.store.database import Database
from adeye.sweep.coverage import Coverage, Situations, coverage_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.store.location import Place


@dataclass(frozen=True)
class ExecutedSituations:
    """What was executed of one stored scenario.

    Attributes:
        scenario: Its content, overrides applied.
        parameters: Resolved parameters in SI of each run; empty where none has a result.
    """

    scenario: Mapping[str, Any]
    parameters: Sequence[Mapping[str, float]]


@dataclass(frozen=True)
class ExecutedRuns:
    """What a campaign executed.

    Attributes:
        planned: Its test cases.
        without_result: Those that were not executed.
        not_judged: Runs in which the scenario did not come about, or that could not be executed.
        outside_odd: Runs whose planned attributes lie outside the ODD.
        situations: The other runs, by stored scenario.
    """

    planned: int
    without_result: int
    not_judged: int
    outside_odd: int
    situations: tuple[ExecutedSituations, ...]


def executed_runs(place: Place, campaign: str) -> ExecutedRuns:
    """Read what a campaign executed.

    Args:
        place: The database, of the current schema.
        campaign: Id of the campaign.
    """
    cases, case, run = tables.campaign_case.c, tables.test_case.c, tables.run.c
    query = (
        select(case.scenario_digest, case.parameters, cases.inside_odd, run.outcome)
        .select_from(tables.campaign_case)
        .join(tables.test_case, case.digest == cases.test_case_digest)
        .join(tables.run, run.result_digest == cases.result_digest, isouter=True)
        .where(cases.campaign_id == campaign)
        .order_by(cases.ordinal)
    )
    database = Database(place)
    found: dict[str, list[Mapping[str, float]]] = {}
    planned = without = unjudged = outside = 0
    try:
        with database.read() as connection:
            for scenario, parameters, inside, outcome in connection.execute(query):
                planned += 1
                rows = found.setdefault(scenario, [])
                if outcome is None:
                    without += 1
                elif not Outcome(outcome).is_judged:
                    unjudged += 1
                elif not inside:
                    outside += 1
                else:
                    rows.append(json.loads(parameters))
            table = tables.scenario.c
            contents = {
                digest: json.loads(
                    connection.execute(
                        select(table.content).where(table.digest == digest)
                    ).scalar_one()
                )
                for digest in found
            }
    finally:
        database.close()
    situations = tuple(ExecutedSituations(contents[key], rows) for key, rows in found.items())
    return ExecutedRuns(planned, without, unjudged, outside, situations)


def declared_attributes(odd: Mapping[str, Any]) -> tuple[Attributes, CoverageBins | None]:
    """Read the attributes and declared bins of a stored ODD, the content of its own file."""
    declared = odd.get("coverage")
    bins = None if declared is None else CoverageBins.model_validate(declared, context=SI)
    return Attributes.model_validate(odd["attributes"], context=SI), bins


def coverage_of_runs(runs: ExecutedRuns, odd: Mapping[str, Any], strength: int) -> Coverage:
    """Count what executed runs cover.

    Args:
        runs: What a campaign executed.
        odd: Stored content of its ODD's own file.
        strength: Most attributes that are combined.
    """
    attributes, bins = declared_attributes(odd)
    situations = (_situations(item) for item in runs.situations)
    return coverage_of(attributes, bins, strength, situations)


def _situations(executed: ExecutedSituations) -> Situations:
    rows = executed.parameters
    names = rows[0] if rows else ()
    columns = {name: np.array([row[name] for row in rows], dtype=np.float64) for name in names}
    scenario = LogicalScenario.model_validate(executed.scenario, context=SI)
    return Situations(scenario, columns, len(rows))
