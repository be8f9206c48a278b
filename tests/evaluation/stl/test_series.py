"""Samples: every sample is a value, declared no conflict, unknown, or an error."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.evaluation.stl.series import SampleStatus, Series, read_samples

NAN, INF = float("nan"), float("inf")


def series(values: list[Any], **options: Any) -> Series:
    arguments: dict[str, Any] = {"scale": 1.0, "unit": "s", "kind": "number", **options}
    return Series(np.array([values]), **arguments)


def statuses(*codes: int) -> np.ndarray:
    return np.array([codes], dtype=np.int8)


def test_without_a_cap_every_value_that_is_not_finite_is_an_error() -> None:
    samples = read_samples(series([1.0, NAN, INF, -INF]))
    assert samples.is_error.tolist() == [[False, True, True, True]]
    assert np.isfinite(samples.values).all()


def test_a_cap_declares_plus_infinity_and_nothing_else() -> None:
    samples = read_samples(series([1.0, NAN, INF, -INF], cap=10.0))
    assert samples.is_error.tolist() == [[False, True, False, True]]
    assert samples.values[0, 2] == INF


def test_a_status_says_what_a_sample_is_whatever_its_value() -> None:
    codes = statuses(
        SampleStatus.VALUE,
        SampleStatus.NO_CONFLICT,
        SampleStatus.NOT_APPLICABLE,
        SampleStatus.ERROR,
        7,
    )
    samples = read_samples(series([1.0, NAN, NAN, 1.0, 1.0], cap=10.0, status=codes))
    assert samples.is_error.tolist() == [[False, False, False, True, True]]
    assert samples.is_unknown.tolist() == [[False, False, True, False, False]]
    assert samples.values[0, 1] == INF


def test_an_infinite_value_with_status_value_is_an_error() -> None:
    assert read_samples(series([INF], cap=10.0, status=statuses(0))).is_error[0, 0]


def test_no_conflict_without_a_cap_is_an_error() -> None:
    assert read_samples(series([INF], status=statuses(1))).is_error[0, 0]


def test_a_truth_value_is_0_or_1() -> None:
    assert not read_samples(series([True, False], kind="boolean")).is_error.any()
    samples = read_samples(series([0.0, 2.0, NAN, INF], kind="boolean", cap=1.0))
    assert samples.is_error.tolist() == [[False, True, True, True]]
    unknown = read_samples(series([NAN], kind="boolean", status=statuses(2)))
    assert (unknown.is_error[0, 0], unknown.is_unknown[0, 0]) == (False, True)


def test_a_code_has_a_label() -> None:
    options: dict[str, Any] = {"kind": "enumeration", "labels": ("ok", "silent")}
    samples = read_samples(series([0, 1, 2, -1], **options))
    assert samples.is_error.tolist() == [[False, False, True, True]]
    assert read_samples(series([0.5], **options)).is_error[0, 0]


def test_reading_leaves_the_series_as_it_was() -> None:
    values = np.array([[NAN, 1.0]])
    read_samples(Series(values, 1.0, "s", "number"))
    assert np.isnan(values[0, 0])


def test_one_run_is_cut_out_with_all_its_arrays() -> None:
    whole = Series(
        np.arange(6.0).reshape(2, 3),
        2.0,
        "m",
        "number",
        status=np.zeros((2, 3), dtype=np.int8),
        cap=5.0,
        actor=np.arange(6).reshape(2, 3),
    )
    one = whole.run(1)
    assert one.values.tolist() == [[3.0, 4.0, 5.0]]
    assert one.actor is not None
    assert one.actor.tolist() == [[3, 4, 5]]
    assert one.status is not None
    assert one.status.shape == (1, 3)
    assert (one.scale, one.cap, one.unit) == (2.0, 5.0, "m")
    assert series([1.0]).run(0).status is None


@pytest.mark.parametrize(
    "options",
    [{"scale": 0.0}, {"scale": NAN}, {"scale": INF}, {"cap": 0.0}, {"cap": INF}, {"cap": -1.0}],
)
def test_scale_and_cap_are_finite_and_positive(options: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="finite and above 0"):
        series([1.0], **options)


def test_shapes_must_agree() -> None:
    with pytest.raises(ValueError, match=r"not \(B, T\)"):
        Series(np.array([1.0]), 1.0, "s", "number")
    with pytest.raises(ValueError, match="differs"):
        series([1.0, 2.0], status=statuses(0))
    with pytest.raises(ValueError, match="differs"):
        series([1.0, 2.0], actor=np.array([[1]]))
