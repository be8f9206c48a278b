"""Tallies counted from columns are those that SQL counts from the rows."""

import math
import random  # noqa: TID251 - tests may draw
from dataclasses import replace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from adeye.errors import IntegrityError
from adeye.judge.verdict import Verdict
from adeye.store import tables
from adeye.store.accounts import done_cases
from adeye.store.block import RunBlock
from adeye.store.records import Block, MetricValue, VerdictRecord
from adeye.store.repository import Repository
from adeye.store.write.results import Counted, count_block, record_judged_runs, tally_rows
from tests.store.conftest import Store
from tests.store.rows import RunRecord, add_verdicts, run_block
from tests.stored import known


def claimed(store: Store, count: int = 4) -> Block:
    return store.claim(store.plan(count, block_size=count).campaign)


def test_result_reads_back_as_it_was_recorded(store: Store) -> None:
    block = claimed(store)
    runs = store.example.runs(block)
    assert store.complete(block, runs)
    stored = store.run(runs[2].result_digest)
    assert dict(stored.metrics) == dict(runs[2].metrics)
    assert stored.events == tuple(runs[2].events)
    infinite = [replace(item, robustness_high=None) for item in runs[2].verdicts]
    assert list(stored.verdicts) == infinite
    assert stored.trace_digest == runs[2].trace_digest
    assert stored.row["outcome"] == "completed"
    assert stored.row["executed_at"] == "2026-01-01T00:00:00.000+00:00"


def test_result_that_was_not_executed_is_none(repository: Repository) -> None:
    assert repository.run_row("0" * 64) is None


def test_different_trace_for_one_test_case_is_an_integrity_error(store: Store) -> None:
    store.campaign(4)
    store.example.thresholds["FSR1"] = "3 m"
    block = claimed(store)
    again = [store.example.run(case, trace_digest="f" * 32) for case in block.to_judge]
    with pytest.raises(IntegrityError, match="two executions of one test case differ"):
        store.complete(block, again)
    assert store.repository.info().rows["verdict"] == 8


def test_two_different_traces_in_one_block_are_an_integrity_error(store: Store) -> None:
    block = claimed(store, 1)
    run = store.example.run(block.cases[0])
    with pytest.raises(IntegrityError, match="differ"):
        store.complete(block, [run, replace(run, trace_digest="f" * 32)])
    assert store.repository.info().rows["run"] == 0


def test_first_of_two_machine_dependent_results_in_one_block_is_kept(store: Store) -> None:
    block = claimed(store, 1)
    run = store.example.run(block.cases[0], is_machine_dependent=True)
    assert store.complete(block, [run, replace(run, trace_digest="f" * 32)])
    stored = store.run(run.result_digest)
    assert stored.trace_digest == run.trace_digest


def test_same_result_again_is_kept_once(store: Store) -> None:
    store.campaign(4)
    store.example.thresholds["FSR1"] = "3 m"
    block = claimed(store)
    again = [store.example.run(case, executed_by="another host") for case in block.to_judge]
    assert store.complete(block, again)
    assert store.repository.info().rows["run"] == 4
    stored = store.run(again[0].result_digest)
    assert stored.row["executed_by"] == "host 1"


def executed_twice(store: Store, *, first_depends: bool = True) -> tuple[RunRecord, RunRecord]:
    """Execute a run while somebody else does so, too; return theirs and ours, not yet completed."""
    ours = claimed(store, 1)
    store.example.with_odd("2")
    theirs = claimed(store, 1)
    first = store.example.run(theirs.cases[0], is_machine_dependent=first_depends)
    assert store.complete(theirs, [first])
    changes = {"trace_digest": "f" * 32, "is_machine_dependent": not first_depends}
    return first, store.example.run(ours.cases[0], **changes)


def save_again(store: Store, run: RunRecord) -> None:
    with store.repository._database.write() as connection:
        record_judged_runs(connection, run_block([run]))


@pytest.mark.parametrize("first_depends", [True, False])
def test_machine_dependent_result_that_is_judged_alike_is_kept_once(
    store: Store, *, first_depends: bool
) -> None:
    first, again = executed_twice(store, first_depends=first_depends)
    save_again(store, replace(again, verdicts=[replace(v, time_s=2.0) for v in again.verdicts]))
    stored = store.run(first.result_digest)
    assert stored.trace_digest == first.trace_digest
    assert {item.time_s for item in stored.verdicts} == {1.5}


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"verdict": Verdict.FAIL, "margin": -0.5}, "FAIL with margin -0.5"),
        ({"margin": 9.0}, "PASS with margin 9.0"),
        # What only the other execution was judged on is not told of the first.
        ({"fsr_digest": "e" * 64}, "not judged in its first execution"),
    ],
)
def test_machine_dependent_result_that_is_judged_otherwise_is_told_and_the_first_stays(
    store: Store, changes: dict[str, Any], told: str
) -> None:
    first, again = executed_twice(store)
    other = [replace(again.verdicts[0], **changes), *again.verdicts[1:]]
    with pytest.raises(IntegrityError, match=told):
        save_again(store, replace(again, verdicts=other))
    assert {str(item.verdict) for item in store.run(first.result_digest).verdicts} == {"PASS"}
    assert store.repository.info().rows["verdict"] == len(first.verdicts)


@pytest.mark.parametrize("words", ["gap >= 2", "gap>=200 cm", None])
def test_verdict_in_other_words_is_the_same(store: Store, *, words: str | None) -> None:
    block = claimed(store, 1)
    run = store.example.run(block.cases[0])
    assert store.complete(block, [run])
    again = [replace(item, predicate=words) for item in run.verdicts]
    assert add_verdicts(store.repository, {run.result_digest: again}) == 0
    assert {item.predicate for item in store.run(run.result_digest).verdicts} == {"gap >= 2"}
    for changes in ({"threshold": 3.0}, {"verdict": Verdict.FAIL}):
        other = [replace(again[0], **changes)]
        with pytest.raises(IntegrityError, match="judged differently"):
            add_verdicts(store.repository, {run.result_digest: other})


def test_verdict_without_a_result_is_refused(store: Store) -> None:
    block = claimed(store, 1)
    run = store.example.run(block.cases[0])
    with pytest.raises(IntegrityError, match="is not in the database"):
        add_verdicts(store.repository, {run.result_digest: run.verdicts})


@pytest.mark.parametrize("change", ["missing", "unknown"])
def test_metrics_must_be_exactly_the_known_ones(store: Store, change: str) -> None:
    block = claimed(store, 1)
    metrics = dict(store.example.metrics(block.cases[0]))
    if change == "missing":
        del metrics["min_ttc_s"]
    else:
        metrics["ttc"] = MetricValue(1.0)
    with pytest.raises(ValueError, match="ttc"):
        store.complete(block, [store.example.run(block.cases[0], metrics=metrics)])
    assert store.repository.info().rows["run"] == 0


def test_infinite_robustness_is_null_never_inf(store: Store) -> None:
    block = claimed(store, 1)
    run = store.example.run(block.cases[0])
    endless = [
        replace(item, robustness_low=-math.inf, robustness_high=math.inf, margin=math.inf)
        for item in run.verdicts
    ]
    assert store.complete(block, [replace(run, verdicts=endless)])
    found = store.rows("SELECT robustness_low, robustness_high, margin FROM verdict")
    assert set(found) == {(None, None, None)}


def test_tally_counts_verdicts_and_keeps_the_worst(store: Store) -> None:
    verdicts = {0: Verdict.FAIL, 4: Verdict.FAIL, 8: Verdict.PASS, 12: Verdict.VACUOUS}
    store.example.verdict_of = lambda case, _fsr: verdicts.get(case.ordinal, Verdict.PASS)
    block = claimed(store, 16)
    runs = store.example.runs(block)
    assert store.complete(block, runs)
    found = store.rows(
        "SELECT verdict, runs, exercised, worst_margin, worst_result_digest FROM tally "
        "WHERE fsr_id = 'FSR1' AND architecture = 'legacy' AND scenario = 'cut_in' ORDER BY 1"
    )
    assert found == [
        ("FAIL", 2, 2, -5.0, runs[4].result_digest),
        ("PASS", 1, 1, 9.0, runs[8].result_digest),
        ("VACUOUS", 1, 0, 13.0, runs[12].result_digest),
    ]


@pytest.mark.parametrize(("verdict", "is_worst"), [(Verdict.FAIL, True), (Verdict.PASS, False)])
def test_unbounded_robustness(store: Store, verdict: Verdict, *, is_worst: bool) -> None:
    store.example.verdict_of = lambda _case, _fsr: verdict
    block = claimed(store, 8)
    runs = store.example.runs(block)
    runs[4] = replace(
        runs[4], verdicts=[replace(item, robustness_low=None) for item in runs[4].verdicts]
    )
    assert store.complete(block, runs)
    worst = store.raw.execute(
        "SELECT worst_result_digest FROM tally "
        "WHERE fsr_id = 'FSR1' AND architecture = 'legacy' AND scenario = 'cut_in'"
    ).fetchone()[0]
    assert (worst == runs[4].result_digest) == is_worst


VERDICTS = tuple(verdict for verdict in Verdict if verdict is not Verdict.NOT_RUN)
NUMBERS = (None, 0.0, -0.0, 0.5, -0.5, 0.5, 2.0, -3.0, float("inf"), float("-inf"))


def planned(store: Store, count: int = 24) -> tuple[str, Block]:
    cases = [
        store.example.case(number, inside_odd=number % 3 != 0, point_index=number)
        for number in range(count)
    ]
    plan = store.plan(cases, block_size=count)
    return plan.campaign, store.claim(plan.campaign)


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
def test_columns_and_rows_count_to_the_same(store: Store, seed: int) -> None:
    campaign, block = planned(store)
    runs = made_up(store.example, block, seed)
    from_columns = known(counted(store.repository, block, runs))
    assert store.repository.complete_block(block, runs)
    with store.repository._database.read() as connection:
        assert from_columns.tallies == tally_rows(connection, block.id)
        assert from_columns.done(connection) == done_cases(connection, block.id)
        stored = connection.execute(tables.tally.select()).all()
    assert {tuple(row) for row in stored} == set(from_columns.tallies)
    assert {case[-1] for case in from_columns.cases} == {0, 1}
    assert sum(row.runs for row in stored) == len(runs.verdicts.run)
    assert store.repository.verify() == ()
    assert store.repository.progress(campaign).accounted == len(runs)


def test_order_of_the_runs_does_not_matter(store: Store) -> None:
    _, block = planned(store)
    records = store.example.runs(block)
    forward = counted(store.repository, block, run_block(records))
    backward = counted(store.repository, block, run_block(records[::-1]))
    assert forward == backward
    assert forward


def test_count_is_left_to_the_rows_where_verdicts_or_runs_are_missing(store: Store) -> None:
    _, block = planned(store)
    records = store.example.runs(block)
    runs = run_block(records)
    parts = [np.arange(1, len(runs.verdicts.run)), np.zeros(0, dtype=np.int64)]
    incomplete = [replace(runs, verdicts=runs.verdicts.take(part)) for part in parts]
    for part in (*incomplete, run_block(records[:-1])):
        assert counted(store.repository, block, part) is None


def test_results_that_exist_are_counted(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    store.campaign(8)
    store.example.thresholds["FSR1"] = "3 m"

    # Nothing is counted from columns, as results are reused.
    refuse = Mock(side_effect=AssertionError)
    monkeypatch.setattr("adeye.store.write.results.count_block", refuse)
    campaign = store.campaign(8)
    assert store.repository.verify() == ()
    assert store.repository.progress(campaign).accounted == 8


def test_basis_of_runs_is_read_by_number_and_version(store: Store) -> None:
    campaign = store.campaign(4)
    again = store.repository.again
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


# --- what judging again reads and counts


def test_evidence_is_what_was_judged(store: Store) -> None:
    campaign = store.campaign(4)
    found = list(store.repository.again.evidence(campaign))
    assert len(found) == 4
    assert {tuple(item.fsrs) for item in found} == {("FSR1", "FSR2")}
    numbers = store.repository.again.numbers([item.result for item in found])
    judged = store.repository.again.judged(list(numbers.values()))
    assert all(store.example.fsr_digest("FSR1") in digests for digests in judged.values())
    assert store.repository.again.fsr_digests(campaign)["FSR1"] == store.example.fsr_digest("FSR1")


def test_block_that_lacks_one_fsr_counts_the_others(store: Store) -> None:
    store.campaign(4)
    store.example.thresholds["FSR1"] = "3 m"
    plan = store.plan(4, block_size=4)
    while (block := store.repository.claim_block(campaign=plan.campaign)) is not None:
        store.repository.again.tally(block)
    status = {
        (item.fsr, item.counts.get(Verdict.NOT_RUN, 0))
        for item in store.repository.fsr_status(plan.campaign)
    }
    assert {fsr for fsr, missing in status if missing and fsr != "FSR3"} == {"FSR1"}
    assert store.repository.verify() == ()
