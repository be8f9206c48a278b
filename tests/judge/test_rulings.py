"""Verdicts on many runs at once, against the rules for one run written plainly."""

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.judge.evaluate import Frame
from adeye.judge.metrics import METRICS
from adeye.judge.requirements import CheckedRequirement, compile_requirement
from adeye.judge.stl.series import SampleStatus
from adeye.judge.uncertainty import NumericUncertainty
from adeye.judge.verdict import STATUSES, Judgement, Verdict
from adeye.ports import MetricColumn
from tests.judge.conftest import fsr
from tests.judge.stl.batch import judge, numbers, truths, words
from tests.stored import known

NAN = math.nan


def checked(**item: Any) -> CheckedRequirement:
    return compile_requirement(fsr(**item))


# One run for each status, on both sides of the limits, with and without contact, invalid or not.
RUNS = list(
    itertools.product(
        STATUSES, (5.0, 10.0, 12.5, 400.0, -0.0), (False, True), (None, "not realised")
    )
)
SO_FAR = {5.0, 12.5}
"""What an incomplete metric is at least; it does not tell the others."""


def has_value(run: int) -> bool:
    status, value, _, _ = RUNS[run]
    return status == "value" or (status == "incomplete" and value in SO_FAR)


COLUMN = MetricColumn(
    np.array([RUNS[run][1] if has_value(run) else NAN for run in range(len(RUNS))]),
    tuple(status for status, _, _, _ in RUNS),
    np.array([1.5 if value > 5.0 else NAN for _, value, _, _ in RUNS]),
    tuple(1 if value > 10.0 else -1 for _, value, _, _ in RUNS),
)
FRAME = Frame(
    step_s=0.1,
    objects=("lead", "cutter"),
    by_contact=np.array([contact for _, _, contact, _ in RUNS]),
    invalid=tuple(reason for _, _, _, reason in RUNS),
)
REASONS = {
    "error": "the metric has no finite value that it may have",
    "no_conflict": "no conflict",
    "not_applicable": "the metric does not apply to this run",
    "undefined": "the metric is undefined in this run",
    "incomplete": "the run ended before the metric was complete",
}


def plainly(item: CheckedRequirement, run: int, least: float) -> Judgement:
    """Rule on one run, step by step."""
    bound = known(item.bound)
    status, _, contact, invalid = RUNS[run]
    metric = bound.metric
    empty = Judgement(item.requirement.id, item.digest, Verdict.INVALID, is_exercised=False)
    if invalid:
        return replace(empty, detail=invalid)
    says: dict[str, Any] = {"predicate": bound.text, "threshold": bound.limit}
    says |= {"unit": metric.unit, "signal": metric.column, "detail": REASONS.get(status)}
    named = replace(empty, verdict=Verdict.ERROR, **says)
    if status == "error":
        return named
    gets_worse = bound.is_lower is (metric.worse == "lower")
    if status in {"value", "no_conflict"} or (has_value(run) and gets_worse):
        found = with_margin(item, named, run)
    elif status == "not_applicable" and not contact:
        return replace(named, verdict=Verdict.VACUOUS)
    else:
        is_open: dict[str, Any] = {"robustness_low": -math.inf, "robustness_high": math.inf}
        found = replace(named, verdict=Verdict.INCONCLUSIVE, **is_open)
        found = replace(found, is_exercised=status == "incomplete")
    if found.verdict is Verdict.INCONCLUSIVE and contact:
        fails = item.requirement.on_contact == "fail"
        detail = "; ".join(part for part in ("ended by contact", found.detail) if part)
        verdict = Verdict.FAIL if fails else Verdict.INCONCLUSIVE
        return replace(found, verdict=verdict, detail=detail)
    if found.verdict is Verdict.PASS and found.margin is not None and found.margin < least:
        detail = f"margin below the numeric uncertainty of {least:g} {metric.unit}"
        return replace(found, verdict=Verdict.INCONCLUSIVE, detail=detail)
    return found


def with_margin(item: CheckedRequirement, named: Judgement, run: int) -> Judgement:
    bound = known(item.bound)
    status, value, contact, _ = RUNS[run]
    metric = bound.metric
    if has_value(run) and metric.cap is not None and value - bound.limit > metric.cap:
        named = replace(named, detail=REASONS["no_conflict"])
        margin = metric.cap if bound.is_lower else -metric.cap
    elif has_value(run):
        margin = value - bound.limit if bound.is_lower else bound.limit - value
    elif metric.cap is not None:
        margin = metric.cap if bound.is_lower else -metric.cap
    else:
        margin = -bound.limit if bound.is_lower else bound.limit
    is_open = margin >= 0.0 and ((contact and not metric.settles) or status == "incomplete")
    if status == "incomplete" and not is_open:
        named = replace(named, detail=None)
    verdict = Verdict.FAIL if margin < 0.0 else Verdict.PASS
    return replace(
        named,
        verdict=Verdict.INCONCLUSIVE if is_open else verdict,
        is_exercised=True,
        robustness_low=-math.inf if is_open else margin / metric.scale,
        robustness_high=margin / metric.scale,
        margin=margin,
        value=value if has_value(run) else None,
        time_s=None if math.isnan(COLUMN.time[run]) else float(COLUMN.time[run]),
        actor=FRAME.objects[COLUMN.actor[run]] if COLUMN.actor[run] >= 0 else None,
    )


SETTLED = next(name for name, metric in METRICS.items() if metric.settles)
BOUNDS: list[dict[str, Any]] = [
    {"metric": "min_distance_m", "at_least": 10.0},
    {"metric": "min_distance_m", "at_most": 10.0},
    {"metric": "max_drac_mps2", "at_most": 10.0},
    {"metric": SETTLED, "at_most": 10.0},
]


@pytest.mark.parametrize("on_contact", ["inconclusive", "fail"])
@pytest.mark.parametrize("least", [0.0, 3.0])
@pytest.mark.parametrize("bound", BOUNDS, ids=lambda bound: "-".join(map(str, bound.values())))
def test_every_run_gets_what_the_rules_for_one_run_say(
    bound: dict[str, Any], least: float, on_contact: str
) -> None:
    item = checked(bound=bound, on_contact=on_contact)
    metrics = {bound["metric"]: COLUMN}
    unit = METRICS[bound["metric"]].unit
    uncertainty = NumericUncertainty(item.digest, {unit: least})
    found = FRAME.judge(item, np.arange(len(RUNS)), None, metrics, uncertainty)
    for run in range(len(RUNS)):
        assert found.of_run(run) == plainly(item, run, least), RUNS[run]


def test_chosen_runs_are_judged_as_among_all() -> None:
    item = checked(bound=BOUNDS[0])
    metrics = {"min_distance_m": COLUMN}
    everything = FRAME.judge(item, np.arange(len(RUNS)), None, metrics, None)
    for runs in ([7], [0, 13, 14, 60], list(range(1, len(RUNS), 2))):
        part = FRAME.judge(item, np.array(runs), None, metrics, None)
        assert part.runs.tolist() == runs
        assert [part.of_run(run) for run in runs] == [everything.of_run(run) for run in runs]


def test_nothing_but_a_value_or_no_conflict_ever_passes() -> None:
    every = np.arange(len(RUNS))
    for bound in BOUNDS:
        found = FRAME.judge(checked(bound=bound), every, None, {bound["metric"]: COLUMN}, None)
        for run, (status, _, _, invalid) in enumerate(RUNS):
            judgement = found.of_run(run)
            if known(judgement).verdict is Verdict.PASS:
                assert status in {"value", "no_conflict"}
                assert invalid is None


@pytest.mark.parametrize("bad", [NAN, math.inf, -math.inf])
def test_value_that_is_not_finite_is_an_error(bad: float) -> None:
    column = MetricColumn(np.array([bad]), ("value",), np.array([0.0]), (0,))
    frame = Frame(0.1, ("lead",), np.array([False]), (None,))
    for bound in BOUNDS:
        item = checked(bound=bound)
        found = frame.judge(item, np.array([0]), None, {bound["metric"]: column}, None).of_run(0)
        assert found is not None
        assert found.verdict is Verdict.ERROR
        assert (found.margin, found.robustness_low, found.value) == (None, None, None)


def ruled(text: str, signals: dict[str, Any], **options: Any) -> list[Judgement]:
    """Judge a formula on runs of which none is invalid."""
    contact = options.pop("contact", None)
    item = checked(formula=text, on_contact=options.pop("on_contact", "inconclusive"))
    result = judge(text, signals, step_s=0.1, **options)
    runs = len(result.error)
    by_contact = np.zeros(runs, bool) if contact is None else np.array(contact)
    frame = Frame(0.1, ("lead", "cutter"), by_contact, (None,) * runs)
    columns = frame.judge(item, np.arange(runs), result, {}, None)
    found = [columns.of_run(run) for run in range(runs)]
    return [item for item in found if item is not None]


def test_formula_has_a_verdict_and_a_reason_on_each_run() -> None:
    inputs = {
        "p": truths([[0, 0, 0], [1, 1, 1], [1, 0, 0], [0, 0, 0], [0, 1, 0]]),
        "a": numbers([[1, 1, 1], [1, 1, 1], [-1, 1, 1], [1, NAN, 1], [1, 1, 1]], unit="m"),
    }
    cut: dict[str, Any] = {"length": [3, 3, 3, 3, 2], "horizon": [2] * 5, "complete": False}
    found = ruled("always(p implies a > 0 m)", inputs, **cut)
    assert [(str(item.verdict), item.detail, item.is_exercised) for item in found] == [
        ("VACUOUS", "the precondition never held", False),
        ("PASS", None, True),
        ("FAIL", None, True),
        ("ERROR", "a signal has a sample that is not a finite number", False),
        ("INCONCLUSIVE", "an obligation is open where the trace ends", True),
    ]
    assert (found[2].margin, found[2].unit, found[2].time_s) == (-1.0, "m", 0.0)
    assert (found[0].margin, found[1].margin) == (None, 1.0)
    assert (found[3].margin, found[3].signal, found[3].robustness_low) == (None, None, None)
    assert (found[4].time_s, found[4].value, found[4].unit) == (None, None, None)


def test_word_is_said_and_is_no_number() -> None:
    (found,) = ruled("always(s.x != off)", {"s.x": words([0, 2, 1], "ok", "ON", "off")})
    assert (found.verdict, found.value, found.threshold) == (Verdict.FAIL, None, None)
    assert (found.detail, found.time_s) == ("s.x is off", 0.1)


def test_what_lies_beyond_the_trace_has_no_unit_and_what_does_not_apply_that_of_its_signal() -> (
    None
):
    cut: dict[str, Any] = {"horizon": [9], "complete": False}
    (beyond,) = ruled("always(a > 0 m)", {"a": numbers([[1.0, 1.0]], unit="m")}, **cut)
    assert (beyond.detail, beyond.unit) == ("an obligation is open where the trace ends", None)
    free = np.full((1, 1), SampleStatus.NOT_APPLICABLE, dtype=np.int8)
    (free_one,) = ruled("always p", {"p": truths([[0]], status=free)})
    assert (free_one.verdict, free_one.unit) == (Verdict.INCONCLUSIVE, "1")


def test_contact_opens_only_what_was_undecided() -> None:
    inputs = {"a": numbers([[1.0, 1.0], [1.0, 1.0], [-1.0, 1.0]])}
    options: dict[str, Any] = {
        "horizon": [5] * 3,
        "complete": False,
        "contact": [True, False, True],
    }
    soft = ruled("always(a > 0)", inputs, **options)
    assert [str(item.verdict) for item in soft] == ["INCONCLUSIVE", "INCONCLUSIVE", "FAIL"]
    assert str(soft[0].detail).startswith("ended by contact; an obligation is open")
    assert str(soft[1].detail).startswith("an obligation is open")
    hard = ruled("always(a > 0)", inputs, on_contact="fail", **options)
    assert [str(item.verdict) for item in hard] == ["FAIL", "INCONCLUSIVE", "FAIL"]
