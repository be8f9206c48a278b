import math
from datetime import datetime
from typing import Any

import pytest

from adeye.errors import InputError
from adeye.identity import digest
from adeye.judge.verdict import Outcome, Verdict
from adeye.store.records import Artifact, ContentRecord, EngineKey, MetricValue, VerdictRecord


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


def test_infrastructure_error_is_no_result(example: Any) -> None:
    case = _block_case(example)
    with pytest.raises(ValueError, match="infrastructure"):
        example.run(case, outcome=Outcome.INFRASTRUCTURE_ERROR)


def test_time_of_day_needs_a_zone(example: Any) -> None:
    case = _block_case(example)
    with pytest.raises(ValueError, match="time zone"):
        example.run(case, executed_at=datetime(2026, 1, 1))  # noqa: DTZ001 - what is refused


@pytest.mark.parametrize("seed", [-1, 2**63])
def test_seed_must_fit_a_column(example: Any, seed: int) -> None:
    with pytest.raises(InputError, match=str(seed)):
        example.case(0, seed=seed)


@pytest.mark.parametrize("name", ["", "../../etc/passwd", "A" * 64, "a" * 63, "a" * 63 + "/"])
def test_artifact_is_named_by_a_digest_and_nothing_else(name: str) -> None:
    with pytest.raises(ValueError, match="sha256"):
        Artifact(name, "trace", None, 1)


def _block_case(example: Any) -> Any:
    from adeye.store.records import BlockCase

    case = example.case(0)
    return BlockCase(0, case.test_case, case.result_digest, has_result=False, missing_fsrs=())
