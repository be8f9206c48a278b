"""Series: scale, cap and shapes are what a formula can be measured with."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.stl.series import Series

NAN, INF = float("nan"), float("inf")


def series(values: list[Any], **options: Any) -> Series:
    arguments: dict[str, Any] = {"scale": 1.0, "unit": "s", "kind": "number", **options}
    return Series(np.array([values]), **arguments)


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
        series([1.0, 2.0], status=np.array([[0]], dtype=np.int8))
    with pytest.raises(ValueError, match="differs"):
        series([1.0, 2.0], actor=np.array([[1]]))
