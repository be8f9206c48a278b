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


@pytest.mark.parametrize(
    "other",
    [
        EngineKey("batch", "v", 1, "p"),
        EngineKey("highway", "w", 1, "p"),
        EngineKey("highway", "v", 2, "p"),
        EngineKey("highway", "v", 1, "q"),
    ],
)
def test_result_depends_on_each_part_of_the_engine(other: EngineKey) -> None:
    key = EngineKey("highway", "v", 1, "p")
    assert key.result_digest("a") == EngineKey("highway", "v", 1, "p").result_digest("a")
    assert other.result_digest("a") != key.result_digest("a")
    assert key.result_digest("b") != key.result_digest("a")


def test_content_is_identified_by_what_it_says_not_by_its_name() -> None:
    record = ContentRecord("a", "1", {"x": 1.0})
    assert record.digest == ContentRecord("b", "2", {"x": 1.0}).digest == digest({"x": 1.0})


@pytest.mark.parametrize(
    ("value", "status"),
    [
        (math.inf, "value"),
        (-math.inf, "value"),
        (math.nan, "value"),
        (math.inf, "no_conflict"),
        (math.nan, "error"),
        (1.0, "error"),
        (None, "value"),
    ],
)
def test_metric_without_finite_value_needs_a_status_and_no_number(
    value: float | None, status: str
) -> None:
    with pytest.raises(ValueError, match="does not fit status"):
        MetricValue(value, status)


@pytest.mark.parametrize("verdict", [item for item in Verdict if item is not Verdict.NOT_RUN])
@pytest.mark.parametrize("field", ["robustness_low", "robustness_high", "margin"])
def test_nan_is_error_and_nothing_else(verdict: Verdict, field: str) -> None:
    values: dict[str, Any] = {field: math.nan}
    if verdict is Verdict.ERROR:
        VerdictRecord("F", "d", verdict, is_exercised=True, **values)
        return
    with pytest.raises(ValueError, match="NaN"):
        VerdictRecord("F", "d", verdict, is_exercised=True, **values)


def test_executed_run_is_never_not_run() -> None:
    with pytest.raises(ValueError, match="NOT_RUN"):
        VerdictRecord("F", "d", Verdict.NOT_RUN, is_exercised=False)


@pytest.mark.parametrize("seed", [-1, 2**63])
def test_seed_must_fit_a_column(example: Any, seed: int) -> None:
    with pytest.raises(InputError, match=str(seed)):
        example.case(0, seed=seed)


def case(ordinal: int, result: str, missing: tuple[str, ...], *, has_result: bool) -> BlockCase:
    return BlockCase(ordinal, f"t{result}", result, has_result=has_result, missing_fsrs=missing)


def test_block_executes_what_has_no_result_once() -> None:
    block = Block(
        1,
        "c",
        1,
        (
            case(0, "a", ("F",), has_result=False),
            case(1, "a", ("F",), has_result=False),
            case(2, "b", ("F",), has_result=True),
            case(3, "c", (), has_result=False),
        ),
    )
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
