"""Tallies counted from columns are those that SQL counts from the rows."""

import math
import random  # noqa: TID251 - tests may draw
import sqlite3
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sqlalchemy import Connection

from adeye.errors import IntegrityError
from adeye.judge.verdict import Verdict
from adeye.store import tables
from adeye.store.accounts import done_cases
from adeye.store.block import RunBlock
from adeye.store.records import Block, MetricValue, VerdictRecord
from adeye.store.repository import Repository
from adeye.store.write import queue as leasing
from adeye.store.write.results import Counted, count_block, tally_rows
from tests.store.rows import add_verdicts, complete_block, run_block


def claimed(repository: Repository, example: Any, count: int = 4) -> Any:
    plan = repository.plan_campaign(example.record(), example.cases(count), block_size=count)
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    return block


def test_result_reads_back_as_it_was_recorded(repository: Repository, example: Any) -> None:
    block = claimed(repository, example)
    runs = example.runs(block)
    assert complete_block(repository, block, runs)
    stored = repository.run_row(runs[2].result_digest)
    assert stored is not None
    assert dict(stored.metrics) == dict(runs[2].metrics)
    assert stored.events == tuple(runs[2].events)
    infinite = [replace(item, robustness_high=None) for item in runs[2].verdicts]
    assert list(stored.verdicts) == infinite
    assert stored.trace_digest == runs[2].trace_digest
    assert stored.row["outcome"] == "completed"
    assert stored.row["executed_at"] == "2026-01-01T00:00:00.000+00:00"


def test_result_that_was_not_executed_is_none(repository: Repository) -> None:
    assert repository.run_row("0" * 64) is None


def test_different_trace_for_one_test_case_is_an_integrity_error(
    repository: Repository, example: Any
) -> None:
    example.campaign(repository, 4)
    example.thresholds["FSR1"] = "3 m"
    block = claimed(repository, example)
    again = [example.run(case, trace_digest="f" * 32) for case in block.to_judge]
    with pytest.raises(IntegrityError, match="two executions of one test case differ"):
        complete_block(repository, block, again)
    assert repository.info().rows["verdict"] == 8


def test_two_different_traces_in_one_block_are_an_integrity_error(
    repository: Repository, example: Any
) -> None:
    block = claimed(repository, example, 1)
    run = example.run(block.cases[0])
    with pytest.raises(IntegrityError, match="differ"):
        complete_block(repository, block, [run, replace(run, trace_digest="f" * 32)])
    assert repository.info().rows["run"] == 0


def test_first_of_two_machine_dependent_results_in_one_block_is_kept(
    repository: Repository, example: Any
) -> None:
    block = claimed(repository, example, 1)
    run = example.run(block.cases[0], is_machine_dependent=True)
    assert complete_block(repository, block, [run, replace(run, trace_digest="f" * 32)])
    stored = repository.run_row(run.result_digest)
    assert stored is not None
    assert stored.trace_digest == run.trace_digest


@pytest.mark.slow
def test_same_result_again_is_kept_once(repository: Repository, example: Any) -> None:
    example.campaign(repository, 4)
    example.thresholds["FSR1"] = "3 m"
    block = claimed(repository, example)
    again = [example.run(case, executed_by="another host") for case in block.to_judge]
    assert complete_block(repository, block, again)
    assert repository.info().rows["run"] == 4
    stored = repository.run_row(again[0].result_digest)
    assert stored is not None
    assert stored.row["executed_by"] == "host 1"


@pytest.mark.parametrize("first_depends", [True, False])
def test_machine_dependent_result_may_differ_and_the_first_is_kept(
    repository: Repository, example: Any, *, first_depends: bool
) -> None:
    block = claimed(repository, example, 1)
    first = example.run(block.cases[0], is_machine_dependent=first_depends)
    assert complete_block(repository, block, [first])
    example.thresholds["FSR1"] = "3 m"
    block = claimed(repository, example, 1)
    example.verdict_of = lambda _case, _fsr: Verdict.FAIL
    case = replace(block.cases[0], missing_fsrs=("FSR1", "FSR2"))
    again = example.run(case, trace_digest="f" * 32, is_machine_dependent=not first_depends)
    assert complete_block(repository, block, [again])
    stored = repository.run_row(first.result_digest)
    assert stored is not None
    assert stored.trace_digest == first.trace_digest
    kept = {(item.fsr_digest, str(item.verdict)) for item in stored.verdicts}
    assert (example.fsr_digest("FSR1"), "FAIL") in kept
    assert (example.fsr_digest("FSR2"), "PASS") in kept


@pytest.mark.parametrize("other", ["gap>=200 cm", None])
def test_predicate_in_other_words_is_the_same_verdict(
    repository: Repository, example: Any, *, other: str | None
) -> None:
    block = claimed(repository, example, 1)
    run = example.run(block.cases[0])
    assert complete_block(repository, block, [run])
    again = [replace(item, predicate=other) for item in run.verdicts]
    assert add_verdicts(repository, {run.result_digest: again}) == 0
    stored = repository.run_row(run.result_digest)
    assert stored is not None
    assert {item.predicate for item in stored.verdicts} == {"gap >= 2"}
    worse = [replace(item, threshold=3.0) for item in again]
    with pytest.raises(IntegrityError, match="judged differently"):
        add_verdicts(repository, {run.result_digest: worse})


def test_judging_one_fsr_differently_is_an_integrity_error(
    repository: Repository, example: Any
) -> None:
    block = claimed(repository, example, 1)
    run = example.run(block.cases[0])
    assert complete_block(repository, block, [run])
    assert add_verdicts(repository, {run.result_digest: run.verdicts}) == 0
    changed = replace(run.verdicts[0], verdict=Verdict.FAIL)
    with pytest.raises(IntegrityError, match="judged differently"):
        add_verdicts(repository, {run.result_digest: [changed]})


def test_verdict_without_a_result_is_refused(repository: Repository, example: Any) -> None:
    block = claimed(repository, example, 1)
    run = example.run(block.cases[0])
    with pytest.raises(IntegrityError, match="is not in the database"):
        add_verdicts(repository, {run.result_digest: run.verdicts})


@pytest.mark.parametrize("change", ["missing", "unknown"])
def test_metrics_must_be_exactly_the_known_ones(
    repository: Repository, example: Any, change: str
) -> None:
    block = claimed(repository, example, 1)
    metrics = dict(example.metrics(block.cases[0]))
    if change == "missing":
        del metrics["min_ttc_s"]
    else:
        metrics["ttc"] = MetricValue(1.0)
    with pytest.raises(ValueError, match="ttc"):
        complete_block(repository, block, [example.run(block.cases[0], metrics=metrics)])
    assert repository.info().rows["run"] == 0


def test_infinite_robustness_is_null_never_inf(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    block = claimed(repository, example, 1)
    run = example.run(block.cases[0])
    endless = [
        replace(item, robustness_low=-math.inf, robustness_high=math.inf, margin=math.inf)
        for item in run.verdicts
    ]
    assert complete_block(repository, block, [replace(run, verdicts=endless)])
    found = raw.execute("SELECT robustness_low, robustness_high, margin FROM verdict").fetchall()
    assert set(found) == {(None, None, None)}


def test_tally_counts_verdicts_and_keeps_the_worst(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    verdicts = {0: Verdict.FAIL, 4: Verdict.FAIL, 8: Verdict.PASS, 12: Verdict.VACUOUS}
    example.verdict_of = lambda case, _fsr: verdicts.get(case.ordinal, Verdict.PASS)
    block = claimed(repository, example, 16)
    runs = example.runs(block)
    assert complete_block(repository, block, runs)
    found = raw.execute(
        "SELECT verdict, runs, exercised, worst_margin, worst_result_digest FROM tally "
        "WHERE fsr_id = 'FSR1' AND architecture = 'legacy' AND scenario = 'cut_in' ORDER BY 1"
    ).fetchall()
    assert found == [
        ("FAIL", 2, 2, -5.0, runs[4].result_digest),
        ("PASS", 1, 1, 9.0, runs[8].result_digest),
        ("VACUOUS", 1, 0, 13.0, runs[12].result_digest),
    ]


@pytest.mark.parametrize(("verdict", "is_worst"), [(Verdict.FAIL, True), (Verdict.PASS, False)])
def test_unbounded_robustness_is_worst_of_a_fail_and_best_of_a_pass(
    repository: Repository,
    example: Any,
    raw: sqlite3.Connection,
    verdict: Verdict,
    *,
    is_worst: bool,
) -> None:
    example.verdict_of = lambda _case, _fsr: verdict
    block = claimed(repository, example, 8)
    runs = example.runs(block)
    runs[4] = replace(
        runs[4], verdicts=[replace(item, robustness_low=None) for item in runs[4].verdicts]
    )
    assert complete_block(repository, block, runs)
    worst = raw.execute(
        "SELECT worst_result_digest FROM tally "
        "WHERE fsr_id = 'FSR1' AND architecture = 'legacy' AND scenario = 'cut_in'"
    ).fetchone()[0]
    assert (worst == runs[4].result_digest) == is_worst


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
    return run_block(records)


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
    forward = counted(repository, block, run_block(records))
    backward = counted(repository, block, run_block(records[::-1]))
    assert forward == backward
    assert forward


def test_missing_verdict_leaves_the_count_to_the_rows(repository: Repository, example: Any) -> None:
    _, block = planned(repository, example)
    runs = run_block(example.runs(block))
    rest = runs.verdicts.take(np.arange(1, len(runs.verdicts.run)))
    assert counted(repository, block, replace(runs, verdicts=rest)) is None
    nothing = runs.verdicts.take(np.zeros(0, dtype=np.int64))
    assert counted(repository, block, replace(runs, verdicts=nothing)) is None


def test_case_that_is_no_run_of_the_block_leaves_the_count_to_the_rows(
    repository: Repository, example: Any
) -> None:
    _, block = planned(repository, example)
    part = run_block(example.runs(block)[:-1])
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


def test_basis_of_runs_is_read_by_number_and_version(repository: Repository, example: Any) -> None:
    campaign = example.campaign(repository, 4)
    again = repository.again
    results = [item.result for item in again.evidence(campaign)]
    numbers = list(again.numbers(results).values())
    bases = again.bases(numbers, 1)
    assert set(bases) == set(numbers)
    assert again.bases(numbers, 2) == {}
    assert all(item[2] == {"min_distance_m": "adeye:min_distance@1"} for item in bases.values())
    assert any(item[1] == "not realised" for item in bases.values())
    measured = again.metric(numbers, "min_distance_m")
    assert {item[1] for item in measured.values()} == {"value"}
    assert set(again.extremes(numbers, "least gap", 1)) == set(numbers)
    assert again.extremes(numbers, "greatest gap", 1) == {}
    assert {number for number, _, _ in again.files(numbers)} == set(numbers)
