"""What the conformance suites demand: that a rule is kept, and that two runs are alike."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


def demand(is_kept: bool, rule: str) -> None:  # noqa: FBT001 - as assert
    """Refuse what does not keep a rule.

    Raises:
        AssertionError: With the rule.
    """
    if not is_kept:
        raise AssertionError(rule)


def demand_equal(
    one: Sequence[Any], other: Sequence[Any], names: Sequence[str], rule: str, *, shown: bool
) -> None:
    """Refuse records of two runs that differ.

    Args:
        one: A record for each tick.
        other: The same of the other run.
        names: Attributes that are compared, arrays or None.
        rule: What is broken if they differ.
        shown: Whether the arrays are told.

    Raises:
        AssertionError: With the rule, the attribute and the tick.
    """
    for tick, (a, b) in enumerate(zip(one, other, strict=True)):
        for name in names:
            left, right = getattr(a, name), getattr(b, name)
            if left is None or right is None:
                demand(left is right, f"{rule}: {name} at tick {tick}")
                continue
            same = np.array_equal(left, right, equal_nan=left.dtype.kind == "f")
            told = f": {left} and {right}" if shown else ""
            demand(same, f"{rule}: {name} at tick {tick}{told}")
