"""Tallies of a block that was executed just now, counted from its columns instead of its rows.

``recording.tally_rows`` and ``accounts.done_cases`` count the same from the database; ``db verify``
compares the two.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.evaluation.judgement import VERDICTS
from adeye.evaluation.verdict import Verdict
from adeye.store import tables
from adeye.store.accounts import Done, save_done
from adeye.store.encoding import Row, row
from adeye.store.inserting import insert_rows
from adeye.store.numbers import run_numbers

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from adeye.signals import Ints
    from adeye.store.block import RunBlock

_LOW, _MARGIN = 0, 2
_FAIL: Final = VERDICTS.index(Verdict.FAIL)

Group = tuple[str, str, bool]
"""Architecture, scenario and whether the planned attributes lie inside the ODD."""
Case = tuple[int, int, str, str, str]
"""Row of the block, ordinal, scenario, architecture and fault entry of a case."""


@dataclass(frozen=True)
class Counted:
    """What was counted of a block.

    Attributes:
        work_id: The block.
        tallies: Rows of ``tally``.
        campaign: Id of its campaign.
        results: Digests of the runs of its cases, in the order of their ordinals.
        cases: Ordinal, scenario, architecture, fault entry of each, and whether its run exercises
            an FSR, 1 or 0.
    """

    work_id: int
    tallies: list[Row]
    campaign: str
    results: list[str]
    cases: list[tuple[int, str, str, str, int]]

    def done(self, connection: Connection) -> list[Done]:
        """Give the cases with their runs, which are saved."""
        numbers = run_numbers(connection, self.results).tolist()
        return [
            (self.campaign, ordinal, number, *told)
            for number, (ordinal, *told) in zip(numbers, self.cases, strict=True)
        ]

    def save(self, connection: Connection) -> None:
        """Save it; the runs are saved."""
        insert_rows(connection, tables.tally, self.tallies)
        save_done(connection, self.work_id, self.done(connection))


def count_block(connection: Connection, work_id: int, block: RunBlock) -> Counted | None:
    """Count the verdicts of a block whose cases are exactly the runs of ``block``.

    Returns:
        What was counted; None if a case of it is no run of the block, or a verdict is missing.
    """
    campaign, cases, groups = _cases(connection, work_id, block)
    if campaign is None:
        return None
    exercised = np.zeros(len(block), dtype=np.int64)
    place = _verdict_places(block)
    fsrs = _fsrs(connection, campaign)
    digests = {word: code for code, word in enumerate(block.verdicts.fsr_digest.dictionary.words)}
    chosen: dict[tuple[str, str, str, str], list[Ints]] = defaultdict(list)
    for (architecture, scenario, is_inside), runs in groups.items():
        for fsr_id, fsr_digest, applies in fsrs.get((architecture, scenario), ()):
            if applies != "everywhere" and (applies == "inside") != is_inside:
                continue
            found = place[np.array(runs), digests[fsr_digest]] if fsr_digest in digests else None
            if found is None or (found < 0).any():
                return None
            chosen[fsr_id, fsr_digest, architecture, scenario].append(found)
            exercised[runs] |= block.verdicts.exercised[found]
    rows: list[Row] = []
    for key in sorted(chosen, key=lambda item: (item[0], *item[2:])):
        rows += _counted(block, work_id, campaign, key, np.concatenate(chosen[key]))
    results = [block.result_digests[case[0]] for case in cases]
    told = [(*case[1:], int(exercised[case[0]])) for case in cases]
    return Counted(work_id, rows, campaign, results, told)


def _cases(
    connection: Connection, work_id: int, block: RunBlock
) -> tuple[str | None, list[Case], dict[Group, list[int]]]:
    """Find the runs of the block behind the cases of a piece of work; no campaign if one lacks.

    Returns:
        Id of the campaign, the cases in the order of their ordinals, and their runs by group.
    """
    of_digest = {digest: run for run, digest in enumerate(block.result_digests)}
    found = connection.exec_driver_sql(
        "SELECT c.campaign_id, c.ordinal, c.result_digest, c.architecture, c.scenario, "
        "c.inside_odd, t.fault_entry "
        "FROM work w JOIN campaign_case c ON c.campaign_id = w.campaign_id "
        "AND c.ordinal >= w.from_ordinal AND c.ordinal < w.to_ordinal "
        "JOIN test_case t ON t.digest = c.test_case_digest WHERE w.id = ? ORDER BY c.ordinal",
        (work_id,),
    )
    cases: list[Case] = []
    groups: dict[Group, list[int]] = defaultdict(list)
    campaign: str | None = None
    for campaign_id, ordinal, digest, architecture, scenario, inside_odd, fault_entry in found:
        run = of_digest.get(digest)
        if run is None:
            return None, [], {}
        campaign = campaign_id
        cases.append((run, ordinal, scenario, architecture, fault_entry))
        groups[architecture, scenario, bool(inside_odd)].append(run)
    return campaign, cases, groups


def _fsrs(
    connection: Connection, campaign: str
) -> dict[tuple[str, str], list[tuple[str, str, str]]]:
    """List id, digest and applicability of the FSRs by architecture and scenario."""
    found = connection.exec_driver_sql(
        "SELECT architecture, scenario, fsr_id, fsr_digest, applies FROM campaign_fsr "
        "WHERE campaign_id = ? AND applicable = 1",
        (campaign,),
    )
    fsrs: dict[tuple[str, str], list[tuple[str, str, str]]] = defaultdict(list)
    for architecture, scenario, *rest in found:
        fsrs[architecture, scenario].append((rest[0], rest[1], rest[2]))
    return fsrs


def _verdict_places(block: RunBlock) -> Ints:
    """Give the row of the verdict on each run and FSR (B, F), -1 for none."""
    verdicts = block.verdicts
    places = np.full(
        (len(block), max(1, len(verdicts.fsr_digest.dictionary.words))), -1, dtype=np.int64
    )
    places[verdicts.run, verdicts.fsr_digest.codes] = np.arange(len(verdicts.run))
    return places


def _counted(
    block: RunBlock, work_id: int, campaign: str, key: tuple[str, str, str, str], found: Ints
) -> list[Row]:
    fsr_id, fsr_digest, architecture, scenario = key
    verdicts = block.verdicts
    kinds = verdicts.verdict[found]
    rows: list[Row] = []
    for kind in sorted(np.unique(kinds).tolist(), key=lambda code: str(VERDICTS[code])):
        same = found[kinds == kind]
        worst = _worst(block, same, is_fail=kind == _FAIL)
        numbers = [_finite(number) for number in verdicts.numbers[worst, [_LOW, _MARGIN]]]
        unit = verdicts.unit[[worst]].values()[0]
        result = block.result_digests[verdicts.run[worst]]
        values: tuple[Any, ...] = (
            work_id, campaign, fsr_id, fsr_digest, architecture, scenario, str(VERDICTS[kind]),
            len(same), int(verdicts.exercised[same].sum()), *numbers, unit, result,
        )  # fmt: skip
        rows.append(row(tables.tally, values))
    return rows


def _worst(block: RunBlock, rows: Ints, *, is_fail: bool) -> int:
    """Find the worst verdict as ``views.WORST_FIRST`` does: NULL is the worst of a FAIL only."""
    margin = block.verdicts.numbers[rows, _MARGIN]
    margin = np.where(np.isfinite(margin), margin, -np.inf if is_fail else np.inf)
    ties = rows[margin == margin.min()]
    return int(min(ties, key=lambda item: block.result_digests[block.verdicts.run[item]]))


def _finite(number: float) -> float | None:
    return float(number) if np.isfinite(number) else None
