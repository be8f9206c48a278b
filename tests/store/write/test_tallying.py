"""Tallies counted from columns are those that SQL counts from the rows."""

import random  # noqa: TID251 - made-up verdicts; no simulated noise
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sqlalchemy import Connection

from adeye.judge.verdict import Verdict
from adeye.store import tables
from adeye.store.accounts import done_cases
from adeye.store.block import RunBlock, run_block
from adeye.store.records import Block, VerdictRecord
from adeye.store.repository import Repository
from adeye.store.write import queue as leasing
from adeye.store.write.results import Counted, count_block, tally_rows

VERDICTS = tuple(verdict for verdict in Verdict if verdict is not Verdict.NOT_RUN)
NUMBERS = (None, 0.0, -0.0, 0.5, -0.5, 0.5, 2.0, -3.0, float("inf"), float("-inf"))


def planned(repository: Repository, example: Any, count: int = 24) -> tuple[str, Block]:
    cases = [
        example.case(number, inside_odd=number % 3 != 0, point_index=number)
        for number in range(count)
    ]
    plan = repository.plan_campaign(example.record(), cases, block_size=count)
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    return plan.campaign, block


def made_up(example: Any, block: Block, seed: int) -> RunBlock:
    """Verdicts of all kinds with many ties."""
    picks = random.Random(seed)  # noqa: S311 - made up

    def verdict(record: VerdictRecord) -> VerdictRecord:
        return replace(
            record,
            verdict=picks.choice(VERDICTS),
            is_exercised=picks.random() < 0.5,
            robustness_low=picks.choice(NUMBERS),
            margin=picks.choice(NUMBERS[:8]),
            unit=picks.choice(["m", "s", None, "größer"]),
        )

    records = [
        replace(record, verdicts=[verdict(item) for item in record.verdicts])
        for record in example.runs(block)
    ]
    return run_block(records, tables.METRIC_IDS)


def counted(repository: Repository, block: Block, runs: RunBlock) -> Counted | None:
    with repository._database.read() as connection:
        return count_block(connection, block.id, runs)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_columns_and_rows_count_to_the_same(
    repository: Repository, example: Any, seed: int
) -> None:
    campaign, block = planned(repository, example)
    runs = made_up(example, block, seed)
    from_columns = counted(repository, block, runs)
    assert from_columns is not None
    assert repository.complete_block(block, runs)
    with repository._database.read() as connection:
        assert from_columns.tallies == tally_rows(connection, block.id)
        assert from_columns.done(connection) == done_cases(connection, block.id)
        stored = connection.execute(tables.tally.select()).all()
    assert {tuple(row) for row in stored} == set(from_columns.tallies)
    assert {case[-1] for case in from_columns.cases} == {0, 1}
    assert sum(row.runs for row in stored) == len(runs.verdicts.run)
    assert repository.verify() == ()
    assert repository.progress(campaign).accounted == len(runs)


def test_order_of_the_runs_does_not_matter(repository: Repository, example: Any) -> None:
    _, block = planned(repository, example)
    records = example.runs(block)
    forward = counted(repository, block, run_block(records, tables.METRIC_IDS))
    backward = counted(repository, block, run_block(records[::-1], tables.METRIC_IDS))
    assert forward == backward
    assert forward


def test_missing_verdict_leaves_the_count_to_the_rows(repository: Repository, example: Any) -> None:
    _, block = planned(repository, example)
    runs = run_block(example.runs(block), tables.METRIC_IDS)
    rest = runs.verdicts.take(np.arange(1, len(runs.verdicts.run)))
    assert counted(repository, block, replace(runs, verdicts=rest)) is None
    nothing = runs.verdicts.take(np.zeros(0, dtype=np.int64))
    assert counted(repository, block, replace(runs, verdicts=nothing)) is None


def test_case_that_is_no_run_of_the_block_leaves_the_count_to_the_rows(
    repository: Repository, example: Any
) -> None:
    _, block = planned(repository, example)
    part = run_block(example.runs(block)[:-1], tables.METRIC_IDS)
    assert counted(repository, block, part) is None


@pytest.mark.slow
def test_block_whose_results_exist_is_counted_from_the_rows(
    repository: Repository, example: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    example.campaign(repository, 8)
    example.thresholds["FSR1"] = "3 m"

    def refuse(_connection: Connection, _work_id: int, _block: RunBlock) -> None:
        pytest.fail("counted from columns although results were reused")

    monkeypatch.setattr(leasing, "count_block", refuse)
    campaign = example.campaign(repository, 8)
    assert repository.verify() == ()
    assert repository.progress(campaign).accounted == 8
