"""Records that the store takes and gives."""

import math
from typing import Any

import pytest

from adeye.errors import InputError
from adeye.identity import digest
from adeye.judge.verdict import Verdict
from adeye.store import records
from tests.refusals import refused


def test_a_field_that_the_row_lacks_is_no_default() -> None:
    row = {"value": 1.0, "status": "value", "time_s": 2.0, "actor": None}
    assert records.of_row(records.MetricValue, row) == records.MetricValue(1.0, "value", 2.0)
    refused(KeyError, records.of_row, records.MetricValue, {"value": 1.0}, says="status")


def test_result_depends_on_each_part_of_the_engine_and_on_the_test_case() -> None:
    keys = [
        records.EngineKey("highway", "v", 1, "p"),
        records.EngineKey("batch", "v", 1, "p"),
        records.EngineKey("highway", "w", 1, "p"),
        records.EngineKey("highway", "v", 2, "p"),
        records.EngineKey("highway", "v", 1, "q"),
    ]
    assert len({key.result_digest(case) for key in keys for case in "ab"}) == 10
    assert keys[0].result_digest("a") == records.EngineKey("highway", "v", 1, "p").result_digest(
        "a"
    )


def test_content_is_identified_by_what_it_says_not_by_its_name() -> None:
    record = records.ContentRecord("a", "1", {"x": 1.0})
    assert record.digest == records.ContentRecord("b", "2", {"x": 1.0}).digest == digest({"x": 1.0})


def test_metric_without_finite_value_needs_a_status_and_no_number() -> None:
    bad = [(value, "value") for value in (math.inf, -math.inf, math.nan, None)]
    for value, status in (*bad, (math.inf, "no_conflict"), (math.nan, "error"), (1.0, "error")):
        refused(ValueError, records.MetricValue, value, status, says="does not fit status")


def test_nan_is_error_and_nothing_else() -> None:
    for field in ("robustness_low", "robustness_high", "margin"):
        values: dict[str, Any] = {"is_exercised": True, field: math.nan}
        records.VerdictRecord("F", "d", Verdict.ERROR, **values)
        for verdict in set(Verdict) - {Verdict.NOT_RUN, Verdict.ERROR}:
            refused(ValueError, records.VerdictRecord, "F", "d", verdict, **values, says="NaN")


def test_executed_run_is_never_not_run() -> None:
    with pytest.raises(ValueError, match="NOT_RUN"):
        records.VerdictRecord("F", "d", Verdict.NOT_RUN, is_exercised=False)


@pytest.mark.parametrize("seed", [-1, 2**63])
def test_seed_must_fit_a_column(example: Any, seed: int) -> None:
    refused(InputError, example.case, 0, seed=seed, says=str(seed))


def test_block_executes_what_has_no_result_once() -> None:
    cases = [
        records.BlockCase(
            ordinal, f"t{result}", result, has_result=has_result, missing_fsrs=missing
        )
        for ordinal, result, missing, has_result in (
            (0, "a", ("F",), False),
            (1, "a", ("F",), False),
            (2, "b", ("F",), True),
            (3, "c", (), False),
        )
    ]
    block = records.Block(1, "c", 1, tuple(cases))
    assert [item.result_digest for item in block.to_execute] == ["a", "c"]
    assert [item.result_digest for item in block.to_judge] == ["b"]


@pytest.mark.parametrize(
    ("state", "text"),
    [
        (records.WorkState(0, 0, 3, 0), "complete"),
        (records.WorkState(0, 1, 3, 1), "running"),
        (records.WorkState(1, 0, 3, 1), "interrupted"),
        (records.WorkState(0, 0, 3, 1), "quarantined"),
    ],
)
def test_state_of_a_campaign_is_that_of_its_blocks(state: records.WorkState, text: str) -> None:
    assert state.text == text
