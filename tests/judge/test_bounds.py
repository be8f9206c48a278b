"""Bounds on metrics: units of what is written, limits and margins."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.judge.metrics import METRICS
from adeye.judge.requirements import Bound, bound_of, requirement_digest
from adeye.spec.concept import Requirement

CONTENT = {
    "id": "FSR-01",
    "goals": ["SG-01"],
    "text": "It shall be so.",
    "threshold_source": "test",
    "asil": "B",
    "allocation": ["camera"],
}


def fsr(metric: str, limit: Any, side: str = "at_most") -> Requirement:
    return Requirement.model_validate({**CONTENT, "bound": {"metric": metric, side: limit}})


@pytest.mark.parametrize(
    ("metric", "text", "number"),
    [
        ("takeover_time_s", "1.5 s", 1.5),
        ("takeover_time_s", "1500 ms", 1.5),
        ("impact_speed_mps", "36 km/h", 10.0),
        ("max_drac_mps2", "6 m/s^2", 6.0),
        ("max_jerk_mps3", "5 m/s³", 5.0),
        ("stop_rating", "3", 3.0),
        ("min_distance_m", "0 m", 0.0),
    ],
)
@pytest.mark.parametrize("side", ["at_most", "at_least"])
def test_text_with_a_unit_is_the_number_in_si_and_the_same_fsr(
    metric: str, text: str, number: float, side: str
) -> None:
    written, plain = fsr(metric, text, side), fsr(metric, number, side)
    assert bound_of(written) == bound_of(plain)
    assert bound_of(written).limit == number
    assert requirement_digest(written) == requirement_digest(plain)
    assert written.model_dump_json() == plain.model_dump_json()


def test_digest_of_a_plain_number_is_what_it_was() -> None:
    assert requirement_digest(fsr("takeover_time_s", 1.5)) == RECORDED


@pytest.mark.parametrize(
    ("metric", "text", "message"),
    [
        (
            "takeover_time_s",
            "1.5 m",
            r"'1.5 m' does not fit .* in s. .*\(s, ms, min, h\)",
        ),
        (
            "takeover_time_s",
            "1.5",
            r"'1.5' does not fit .* in s. Write a plain number in s",
        ),
        ("trips", "2 s", r"'2 s' does not fit metric trips, which is a plain number"),
    ],
)
def test_unit_of_something_else_is_refused(metric: str, text: str, message: str) -> None:
    with pytest.raises(SpecError, match=message):
        bound_of(fsr(metric, text))
    with pytest.raises(SpecError, match=message):
        bound_of(pickle.loads(pickle.dumps(fsr(metric, text))))  # noqa: S301 - its own


@pytest.mark.parametrize("text", ["1.5 parsec", "soon", "", "1e999 s", True])
def test_what_is_no_quantity_is_refused_at_its_place(text: Any) -> None:
    with pytest.raises(ValueError, match=r"bound\.at_most"):
        fsr("takeover_time_s", text)


@pytest.mark.parametrize("unit", ["km/h", "pint"])
def test_metric_that_is_not_in_si_takes_plain_numbers_only(
    unit: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(METRICS, "mine", replace(METRICS["impact_speed_mps"], unit=unit))
    assert bound_of(fsr("mine", 30.0)).limit == 30.0
    with pytest.raises(SpecError, match=f"is in {unit}. Write a plain number"):
        bound_of(fsr("mine", "30 km/h"))


def test_margin_is_the_distance_to_the_limit_and_the_cap_without_a_conflict() -> None:
    values, free = np.array([4.0, 7.0, np.nan]), np.array([False, False, True])
    high = bound_of(fsr("min_distance_m", "5 m", "at_least"))
    assert high.margins(values, free)[0].tolist() == [-1.0, 2.0, METRICS["min_distance_m"].cap]
    low = bound_of(fsr("max_drac_mps2", "5 m/s^2"))
    assert low.margins(values, free)[0].tolist() == [1.0, -2.0, 5.0]
    assert low.text == "max_drac_mps2 <= 5 m/s²"


@pytest.mark.parametrize("name", [name for name, metric in METRICS.items() if metric.cap])
@pytest.mark.parametrize("is_lower", [True, False])
def test_a_conflict_beyond_the_cap_is_none(name: str, *, is_lower: bool) -> None:
    cap = METRICS[name].cap
    assert cap is not None
    limit = 0.5 * cap
    values = limit + np.array([np.nan, 1.01 * cap, 1_000.0 * cap, 0.5 * cap, -3.0 * cap])
    free = np.array([True, False, False, False, False])
    margins, is_free = Bound(name, limit, is_lower=is_lower).margins(values, free)
    assert margins[:3].tolist() == [cap if is_lower else -cap] * 3
    assert is_free.tolist() == [True, True, True, False, False]
    assert np.abs(margins[3:]) == pytest.approx([0.5 * cap, 3.0 * cap])


RECORDED = "f4daa255848ec13c3ca49e585067bc312454755c27b6a78ebe60b77a2e274088"


@pytest.mark.parametrize("is_lower", [True, False])
def test_what_lies_on_a_bound_as_a_decimal_has_no_margin(*, is_lower: bool) -> None:
    name = next(name for name, metric in METRICS.items() if metric.cap is None)
    values = np.array([0.1 + 0.2, 6 * 0.05])
    margins, _ = Bound(name, 0.3, is_lower).margins(values, np.zeros(2, np.bool_))
    assert margins.tolist() == [0.0, 0.0]
