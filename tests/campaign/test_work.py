"""The work of one block, and the samples that it keeps to be judged again by."""

from __future__ import annotations

import ctypes
import ctypes.util
import json
import pickle
import platform
from dataclasses import fields, is_dataclass, replace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from adeye.campaign import warmup, work
from adeye.campaign.run import Progress
from adeye.campaign.work import BatchTask, compiled_parts
from adeye.errors import PlatformError, SpecError
from adeye.judge.evaluate import Evaluation
from adeye.judge.extremes import Extremes
from adeye.judge.outcome import OUTCOMES
from adeye.judge.verdict import STATUSES, VERDICTS, Outcome, Verdict
from adeye.simulate import engine
from adeye.store.block import MetricBlock
from adeye.store.encoding import Texts
from adeye.store.tables import METRIC_IDS
from adeye.sweep.case import TestCase
from adeye.trace import Trace
from tests.conftest import MakeProject
from tests.project import Executed
from tests.stored import known

# --- the work of one block: run, measure, judge, describe


Candidates = tuple[list[TestCase], Trace]


def task(mini: Executed, cases: list[TestCase], **changes: Any) -> work.BatchTask:
    parts = {"block": 1, "execute": tuple(cases), "judge": (), **changes}
    return work.BatchTask(**parts, context=mini.plan.work)


@pytest.mark.parametrize("way", ["FE_DOWNWARD", "FE_UPWARD", "FE_TOWARDZERO"])
def test_thread_that_rounds_otherwise_than_to_nearest_executes_nothing(
    mini: Executed, way: str
) -> None:
    ways = {"FE_DOWNWARD": 0x400, "FE_UPWARD": 0x800, "FE_TOWARDZERO": 0xC00}
    if platform.machine() != "x86_64":
        pytest.skip("numbers of the modes are those of x86-64")
    library = ctypes.CDLL(ctypes.util.find_library("m"))
    cases = [next(iter(mini.plan.expansion.cases()))]
    assert library.fesetround(ways[way]) == 0
    try:
        with pytest.raises(PlatformError, match="does not round to nearest"):
            work.execute(task(mini, cases))
    finally:
        library.fesetround(0)


@pytest.fixture(scope="module")
def done(mini: Executed, cut_ins: Candidates) -> work.BatchResult:
    """The cut-ins, executed as one block."""
    return work.execute(task(mini, cut_ins[0]))


@pytest.mark.slow
def test_block_is_executed(mini: Executed, cut_ins: Candidates, done: work.BatchResult) -> None:
    cases, trace = cut_ins
    assert (done.failure, done.done) == ("", len(cases))
    runs = known(done.runs)
    assert runs.test_cases == tuple(case.digest for case in cases)
    assert runs.trace_digests == tuple(trace.digests())
    assert {OUTCOMES[code] for code in runs.outcome} == {Outcome.COMPLETED}
    assert runs.trace_rows.tolist() == trace.length.tolist()
    assert runs.duration_s[0] == pytest.approx(25.0)
    assert runs.metrics.ids == METRIC_IDS
    first = runs.verdicts.take(runs.verdicts.run == 0)
    digests = {item.requirement.id: item.digest for item in mini.plan.requirements}
    fsrs = [item.id for item in mini.plan.files.concept.spec.requirements]
    assert first.fsr_id.values() == fsrs
    assert first.fsr_digest.values() == [digests[name] for name in fsrs]


@pytest.mark.slow
def test_metric_has_a_finite_value_or_says_why_not(done: work.BatchResult) -> None:
    metrics = known(done.runs).metrics
    assert (np.isfinite(metrics.value) == (metrics.status == STATUSES.index("value"))).all()
    impact = metrics.status[:, METRIC_IDS.index("impact_speed_mps")]
    assert {STATUSES[code] for code in impact} == {"no_conflict"}
    nearest = metrics.actor[:, METRIC_IDS.index("min_distance_m")]
    assert {metrics.actors.words[code] for code in nearest} == {"cutter"}


@pytest.mark.slow
def test_result_is_judged_on_what_it_lacks(mini: Executed, cut_ins: Candidates) -> None:
    cases, trace = cut_ins
    judge = ((cases[0], "a" * 64, ("FSR-03",)),)
    result = work.execute(task(mini, cases[1:2], judge=judge))
    assert result.runs is not None
    assert result.runs.test_cases == (cases[1].digest,)
    assert set(result.runs.verdicts.run.tolist()) == {0}
    judged = known(result.judged)
    assert judged.result_digests == ("a" * 64,)
    assert judged.verdicts.fsr_id.values() == ["FSR-03"]
    assert judged.verdicts.run.tolist() == [0]
    assert VERDICTS[judged.verdicts.verdict[0]] is Verdict.PASS
    assert judged.trace_digests == (trace.digests()[0],)
    assert result.done == 2


def test_a_block_is_as_it_was_after_a_pipe(done: work.BatchResult) -> None:
    runs = known(done.runs)
    sent = pickle.dumps(runs)
    assert same(pickle.loads(sent), runs)  # noqa: S301 - made here
    # What the runs share is sent once.
    one = pickle.dumps(runs.take(np.array([0])))
    assert len(sent) - len(one) < 4500 * (len(runs) - 1)


def test_empty_block_has_no_results(mini: Executed) -> None:
    assert work.execute(task(mini, [])) == work.BatchResult()


def test_defect_is_recorded(
    mini: Executed, cut_ins: Candidates, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(work, "run_batch", Mock(side_effect=ZeroDivisionError("by zero")))
    result = work.execute(task(mini, cut_ins[0]))
    assert (result.runs, result.failure) == (None, "ZeroDivisionError: by zero")


def test_wrong_input_is_the_users_business(mini: Executed, cut_ins: Candidates) -> None:
    case = cut_ins[0][0]
    camera = case.architecture.sensors["front_camera"].model_copy(update={"rate": 7.0})
    sensors = {**case.architecture.sensors, "front_camera": camera}
    odd = replace(case, architecture=case.architecture.model_copy(update={"sensors": sensors}))
    with pytest.raises(SpecError, match=r"sensors\.front_camera\.rate"):
        work.execute(task(mini, [odd]))


@pytest.mark.slow
def test_description_does_not_depend_on_the_batch(mini: Executed, cut_ins: Candidates) -> None:
    cases, trace = cut_ins
    requirements = mini.plan.files.concept.spec.requirements
    whole = work.evaluate(trace, cases, requirements, mini.plan.faults)
    alone = work.execute(task(mini, cases[2:3])).runs
    key = mini.plan.engines["camera_radar"]
    together = work.describe(trace, whole, [key] * len(cases)).take(np.array([2]))
    assert alone is not None
    assert same(replace(together, executed_at=alone.executed_at), alone)


def same(one: Any, other: Any) -> bool:
    """Compare what two parts of a block say, however it is numbered."""
    if isinstance(one, Texts):
        return bool(one.values() == other.values())
    if isinstance(one, np.ndarray):
        return bool(np.array_equal(one, other, equal_nan=one.dtype.kind == "f"))
    if isinstance(one, MetricBlock):
        names = (one.actors.objects[one.actor], other.actors.objects[other.actor])
        rest = ("ids", "value", "status", "time_s")
        parts: bool = all(same(getattr(one, name), getattr(other, name)) for name in rest)
        return parts and bool(names[0].tolist() == names[1].tolist())
    if is_dataclass(one):
        return all(same(getattr(one, item.name), getattr(other, item.name)) for item in fields(one))
    return bool(one == other)


# --- samples go into the database and come out as they were


def test_samples_come_back_bit_for_bit() -> None:
    kept = Extremes(
        run=np.array([0, 1]),
        row=np.array([[0, 2, 7, -1, -1], [3, -1, 3, 5, 6]]),
        value=np.array(
            [[0.1, 1 / 3, -0.0, np.nan, np.nan], [np.nan, np.nan, np.nan, np.nan, 1e300]]
        ),
        status=np.array([[0, 0, 0, 0, 0], [1, 0, 1, 2, 3]]),
        actor=np.array([[-1, 0, 1, -1, -1], [1, -1, 1, -1, -1]]),
        is_cut=np.array([True, False]),
    )
    texts = work._samples_texts(kept, ("cutter", "lead"))
    objects: dict[str, int] = {}
    found = work.extremes_of([json.loads(text) for text in texts], objects)
    assert objects == {"cutter": 0, "lead": 1}
    for name in ("row", "value", "status", "actor", "is_cut"):
        np.testing.assert_array_equal(getattr(found, name), getattr(kept, name))


# --- warming up: one test case of each structure is executed, and nothing is kept


def test_one_of_each_structure(make_project: MakeProject, monkeypatch: pytest.MonkeyPatch) -> None:
    project = make_project()
    plan = project.plan()
    tasks: list[BatchTask] = []

    def execute(task: BatchTask) -> work.BatchResult:
        tasks.append(task)
        return work.BatchResult()

    monkeypatch.setattr(warmup, "execute", execute)
    seen: list[Progress] = []
    warmup.warm_up(plan, seen.append)
    examples = [case.digest for case in plan.examples()]
    assert [[case.digest for case in task.execute] for task in tasks] == [[it] for it in examples]
    told = [(state.done, state.phase) for state in seen]
    assert told == [(done, "compile") for done in range(len(examples))]
    assert not project.db.exists()
    monkeypatch.setattr(warmup, "execute", lambda _: work.BatchResult(failure="OSError: no room"))
    with pytest.raises(PlatformError, match=r"with .*: OSError: no room"):
        warmup.warm_up(plan)


@pytest.mark.slow
def test_compiling_aside(make_project: MakeProject, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = make_project().plan()
    task = BatchTask(0, (plan.cases[0],), (), plan.work)
    found: list[Evaluation] = []
    lengths: list[int] = []

    def judged(*arguments: Any) -> Evaluation:
        found.append(work.evaluate(*arguments))
        return found[-1]

    def driven(*arguments: Any, **options: Any) -> Any:
        trace = engine.run(*arguments, **options)
        lengths.extend(trace.length.tolist())
        return trace

    monkeypatch.setattr(warmup, "evaluate", judged)
    monkeypatch.setattr(work, "run_batch", driven)
    assert warmup._compile_part((warmup._drive, task))
    assert warmup._compile_part((warmup._judge, task))
    assert warmup._compile_part((warmup._measure, task))
    assert warmup._compile_part(warmup._EVALUATING)
    # One goes to its end and one only begins, yet its formulas are evaluated.
    assert lengths[0] > 10
    assert lengths[1:] == [1, 1]
    codes = {code for item in found[0].judged for code in item.verdict}
    assert VERDICTS.index(Verdict.PASS) in codes


@pytest.mark.slow
def test_failure_aside_is_left_to_the_run(make_project: MakeProject) -> None:
    plan = make_project().plan()
    assert warmup.compile_aside(plan, warmup.begin_aside(2))
    task = BatchTask(0, (), (), plan.work)
    assert not warmup._compile_part((warmup._judge, task))


def test_every_part_is_compiled_aside_and_none_for_nothing(make_project: MakeProject) -> None:
    plan = make_project().plan()
    chosen = warmup._covering(plan)
    parts = [
        compiled_parts(case.architecture, plan.work) | {str(bool(case.faults))} for case in chosen
    ]
    assert frozenset().union(*parts) - {"True", "False"} == plan.compiled_parts
    assert {"sensor-camera", "channel-nominal", "traffic-batch-reference-1"} <= plan.compiled_parts
    for number in range(len(parts)):
        assert not parts[number] <= frozenset().union(*parts[:number])
