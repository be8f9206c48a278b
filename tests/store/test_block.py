"""Blocks of results: what goes in one by one comes out as columns, whole or in part."""

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest

from adeye.judge.verdict import Outcome, Verdict
from adeye.store.block import (
    BasisBlock,
    ExtremeBlock,
    JudgedBlock,
    MetricBlock,
    VerdictBlock,
)
from adeye.store.encoding import Dictionary, Texts
from adeye.store.records import BlockCase, EventRecord, MetricValue
from tests.store.rows import RunRecord, event_block, run_block


@pytest.fixture
def records(example: Any) -> list[RunRecord]:
    """Five runs with different numbers of verdicts and events, some with metrics of a plug-in."""
    example.verdict_of = lambda case, _: Verdict.FAIL if case.ordinal in {1, 4} else Verdict.PASS
    cases = [
        BlockCase(
            ordinal=number,
            test_case=f"{number:064x}",
            result_digest=f"{number:064x}",
            missing_fsrs=("FSR1", "FSR2")[: number % 3],
            has_result=False,
        )
        for number in range(5)
    ]
    made = []
    for case in cases:
        events = [EventRecord(0.1 * k, "fault", None, f"größer {k}") for k in range(case.ordinal)]
        own = {"ours": {"mine": MetricValue(1.0 * case.ordinal)}} if case.ordinal % 2 else {}
        made.append(example.run(case, events=events, plugin_metrics=own))
    return made


def said(part: Any) -> Any:
    """What a part of a block says, however its texts are numbered."""
    if isinstance(part, Texts):
        return part.values()
    if isinstance(part, Dictionary):
        return None
    if isinstance(part, MetricBlock):
        actors = Texts(part.actor, part.actors).codes
        names = part.actors.objects[actors].tolist()
        numbers = [repr(item) for item in (part.value.tolist(), part.time_s.tolist())]
        return part.ids, numbers, part.status.tolist(), names
    if isinstance(part, np.ndarray):
        return repr(part.tolist())
    if is_dataclass(part):
        return {item.name: said(getattr(part, item.name)) for item in fields(part)}
    return [said(item) for item in part] if isinstance(part, tuple | list) else part


@pytest.mark.parametrize("runs", [[0], [3], [1, 2], [0, 2, 4], [0, 1, 2, 3, 4], []])
def test_chosen_runs_are_those_runs_alone(records: list[RunRecord], runs: list[int]) -> None:
    chosen = said(run_block(records).take(np.array(runs, dtype=np.int64)))
    alone = said(run_block([records[run] for run in runs]))
    for part in ("engines", "plugin_metrics"):
        chosen.pop(part)
        alone.pop(part)
    assert chosen == alone


def test_metrics_of_a_plug_in_stay_with_their_runs(records: list[RunRecord]) -> None:
    (block,) = run_block(records).plugin_metrics
    assert (block.plugin, block.run.tolist()) == ("ours", [1, 3])
    part = block.take(np.array([2, 3]))
    assert part.run.tolist() == [1]
    assert part.metrics.value.tolist() == [[3.0]]


def test_events_are_numbered_run_by_run(records: list[RunRecord]) -> None:
    events = run_block(records).events
    assert events.run.tolist() == [1, 2, 2, 3, 3, 3, 4, 4, 4, 4]
    assert events.seq.tolist() == [0, 0, 1, 0, 1, 2, 0, 1, 2, 3]
    assert events.subject.values() == [None] * 10
    assert event_block([[], []]).seq.tolist() == []


def test_runs_with_a_failure_are_counted_once(records: list[RunRecord]) -> None:
    verdicts = run_block(records).verdicts
    assert verdicts.failures == 2
    assert verdicts.take(verdicts.run != 1).failures == 1
    assert VerdictBlock.of(()).failures == 0


def test_identity_of_a_result_is_that_of_its_record(records: list[RunRecord]) -> None:
    block = run_block(records)
    assert block.result_digests == tuple(record.result_digest for record in records)
    assert len(block) == 5


def test_engines_are_listed_once(records: list[RunRecord]) -> None:
    other = replace(records[3].engine, variant="exact")
    mixed = [*records[:3], replace(records[3], engine=other), records[4]]
    block = run_block(mixed)
    assert len(block.engines) == 2
    assert block.engine.tolist() == [0, 0, 0, 1, 0]
    assert block.result_digests[3] == mixed[3].result_digest


def test_value_of_a_metric_is_finite_and_fits_its_status() -> None:
    def metric_block(value: float, status: int) -> MetricBlock:
        return MetricBlock(
            ("gap_m",),
            np.array([[value]]),
            np.array([[status]]),
            np.array([[np.nan]]),
            np.array([[-1]]),
            Dictionary((None,)),
        )

    for value in (np.nan, np.inf, -np.inf):
        with pytest.raises(ValueError, match="metric gap_m"):
            metric_block(value, status=0)
    for value in (0.0, np.inf):
        with pytest.raises(ValueError, match="no_conflict"):
            metric_block(value, status=1)


def test_infrastructure_error_is_no_result(records: list[RunRecord]) -> None:
    block = run_block(records)
    code = list(Outcome).index(Outcome.INFRASTRUCTURE_ERROR)
    with pytest.raises(ValueError, match="no result"):
        replace(block, outcome=np.full(5, code))


def test_judged_verdicts_belong_to_the_place_of_their_result(records: list[RunRecord]) -> None:
    block = JudgedBlock.of({"a" * 64: records[2].verdicts, "b" * 64: records[1].verdicts})
    assert block.result_digests == ("a" * 64, "b" * 64)
    assert block.verdicts.run.tolist() == [0, 0, 1]
    assert block.verdicts.fsr_id.values() == ["FSR1", "FSR2", "FSR1"]
    assert block.trace_digests == ()


def block() -> BasisBlock:
    extremes = ExtremeBlock(
        run=np.array([0, 1, 1, 3]),
        measure=Texts.of(["least gap", "least gap", "least ttc", "least gap"]),
        value=np.array([1.0, 2.0, 3.0, 4.0]),
        time_s=np.array([0.1, 0.2, 0.3, 0.4]),
        actor=Texts.of(["lead", None, "lead", "cutter"]),
        samples=Texts.of(["a", "b", "c", "d"]),
    )
    return BasisBlock(
        version=1,
        uids={"contact": "adeye:contact@1"},
        by_contact=np.array([True, False, False, True]),
        invalid=Texts.of([None, "not realised", None, None]),
        extremes=extremes,
        files=(("t.npz", 0), None, ("t.npz", 2), ("t.npz", 3)),
    )


def test_chosen_runs_keep_their_samples_under_new_numbers() -> None:
    chosen = block().take(np.array([1, 3]))
    assert chosen.by_contact.tolist() == [False, True]
    assert chosen.invalid.values() == ["not realised", None]
    assert chosen.files == (None, ("t.npz", 3))
    assert chosen.extremes.run.tolist() == [0, 0, 1]
    assert chosen.extremes.samples.values() == ["b", "c", "d"]
    assert chosen.extremes.value.tolist() == [2.0, 3.0, 4.0]


def test_run_without_samples_has_none() -> None:
    assert block().take(np.array([2])).extremes.run.tolist() == []


def test_block_that_keeps_no_trace_has_no_files() -> None:
    whole = block()
    bare = BasisBlock(1, whole.uids, whole.by_contact, whole.invalid, whole.extremes)
    assert bare.take(np.array([0, 2])).files == ()
