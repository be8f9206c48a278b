"""Records that the store takes and gives."""

import math
from typing import Any

import pytest

from adeye.errors import InputError
from adeye.identity import digest
from adeye.judge.verdict import Verdict
from adeye.store.records import (
    Block,
    BlockCase,
    ContentRecord,
    EngineKey,
    Finding,
    MetricValue,
    Plan,
    VerdictRecord,
    WorkState,
    of_row,
)


def test_a_field_that_the_row_lacks_is_no_default() -> None:
    row = {"value": 1.0, "status": "value", "time_s": 2.0, "actor": None}
    assert of_row(MetricValue, row) == MetricValue(1.0, "value", 2.0)
    with pytest.raises(KeyError, match="status"):
        of_row(MetricValue, {"value": 1.0})


def test_result_depends_on_each_part_of_the_engine_and_on_the_test_case() -> None:
    keys = [
        EngineKey("highway", "v", 1, "p"),
        EngineKey("batch", "v", 1, "p"),
        EngineKey("highway", "w", 1, "p"),
        EngineKey("highway", "v", 2, "p"),
        EngineKey("highway", "v", 1, "q"),
    ]
    assert len({key.result_digest(case) for key in keys for case in "ab"}) == 10
    assert keys[0].result_digest("a") == EngineKey("highway", "v", 1, "p").result_digest("a")


def test_content_is_identified_by_what_it_says_not_by_its_name() -> None:
    record = ContentRecord("a", "1", {"x": 1.0})
    assert record.digest == ContentRecord("b", "2", {"x": 1.0}).digest == digest({"x": 1.0})


def test_metric_without_finite_value_needs_a_status_and_no_number() -> None:
    bad = [(value, "value") for value in (math.inf, -math.inf, math.nan, None)]
    for value, status in (*bad, (math.inf, "no_conflict"), (math.nan, "error"), (1.0, "error")):
        with pytest.raises(ValueError, match="does not fit status"):
            MetricValue(value, status)


def test_nan_is_error_and_nothing_else() -> None:
    for field in ("robustness_low", "robustness_high", "margin"):
        values: dict[str, Any] = {"is_exercised": True, field: math.nan}
        VerdictRecord("F", "d", Verdict.ERROR, **values)
        for verdict in set(Verdict) - {Verdict.NOT_RUN, Verdict.ERROR}:
            with pytest.raises(ValueError, match="NaN"):
                VerdictRecord("F", "d", verdict, **values)


def test_executed_run_is_never_not_run() -> None:
    with pytest.raises(ValueError, match="NOT_RUN"):
        VerdictRecord("F", "d", Verdict.NOT_RUN, is_exercised=False)


@pytest.mark.parametrize("seed", [-1, 2**63])
def test_seed_must_fit_a_column(example: Any, seed: int) -> None:
    with pytest.raises(InputError, match=str(seed)):
        example.case(0, seed=seed)


def test_block_executes_what_has_no_result_once() -> None:
    cases = [
        BlockCase(ordinal, f"t{result}", result, has_result=has_result, missing_fsrs=missing)
        for ordinal, result, missing, has_result in (
            (0, "a", ("F",), False),
            (1, "a", ("F",), False),
            (2, "b", ("F",), True),
            (3, "c", (), False),
        )
    ]
    block = Block(1, "c", 1, tuple(cases))
    assert [item.result_digest for item in block.to_execute] == ["a", "c"]
    assert [item.result_digest for item in block.to_judge] == ["b"]


@pytest.mark.parametrize(
    ("state", "text"),
    [
        (WorkState(0, 0, 3, 0), "complete"),
        (WorkState(0, 1, 3, 1), "running"),
        (WorkState(1, 0, 3, 1), "interrupted"),
        (WorkState(0, 0, 3, 1), "quarantined"),
    ],
)
def test_state_of_a_campaign_is_that_of_its_blocks(state: WorkState, text: str) -> None:
    assert state.text == text


def test_plan_reuses_what_it_does_not_execute() -> None:
    assert Plan("c", 10, to_execute=3, to_judge=2, is_new=True).reused == 7


def test_finding_reads_as_table_row_and_problem() -> None:
    assert str(Finding("run", "abc", "altered")) == "run abc: altered"
    assert str(Finding("database", "", "page 3")) == "database: page 3"
