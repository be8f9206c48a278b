"""Random states with their seams in it, and what it means that two implementations agree.

They agree on a state if their numbers are the same to a relative 1e-9 and their infinities the same
outright. Where they are not, they still agree if the state lies on a seam: if numbers that differ
by a relative 1e-9 from those of the state take the second implementation to both sides of what the
product says. How many states may need that is limited, so that it hides nothing.
"""

import math
from collections.abc import Callable, Sequence
from itertools import product
from typing import Any

import numpy as np

SAME = 1e-9
SEAM = 1e-9

Draw = Callable[[Any, int], Any]


def between(low: float, high: float, *special: float, often: float = 0.1) -> Draw:
    """Draw evenly between two ends; some of the draws are one of the special numbers instead."""

    def draw(generator: Any, count: int) -> Any:
        values = generator.uniform(low, high, count)
        if special:
            chosen = generator.random(count) < often
            values[chosen] = generator.choice(np.array(special), int(chosen.sum()))
        return values

    return draw


def is_same(a: float, b: float, absolute: float) -> bool:
    if math.isinf(a) or math.isinf(b) or math.isnan(a) or math.isnan(b):
        return a == b
    return abs(a - b) <= max(SAME * max(abs(a), abs(b)), absolute)


def parts(value: float | tuple[float, ...]) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (float(value),)


def on_a_seam(
    mine: tuple[float, ...], second: Callable[..., Any], state: Sequence[float], absolute: float
) -> bool:
    """Whether states that differ by as good as nothing are on both sides of what the product says.

    Each number is as it is, a little less and a little more; all combinations of up to six numbers,
    one number after the other beyond.
    """
    if len(state) <= 6:
        changes = list(product((0.0, -SEAM, SEAM), repeat=len(state)))
    else:
        changes = [
            tuple(sign * SEAM * (k == number) for k in range(len(state)))
            for number in range(len(state))
            for sign in (-1.0, 1.0)
        ]
    found = [
        parts(second(*(value + change * max(1.0, abs(value)) if math.isfinite(value) else value
                       for value, change in zip(state, some, strict=True))))
        for some in changes
    ]  # fmt: skip
    return all(
        min(values) - absolute <= own <= max(values) + absolute
        for own, values in zip(mine, zip(*found, strict=True), strict=True)
    )


def disagreements(
    own: Callable[..., Any],
    second: Callable[..., Any],
    states: Any,
    *,
    absolute: float = 1e-12,
) -> tuple[list[Any], int]:
    """Compare two implementations on (N, arguments) states.

    Returns:
        States with what both say where they disagree, and how many were on a seam.
    """
    wrong, seams = [], 0
    for state in states.tolist():
        mine, other = parts(own(*state)), parts(second(*state))
        if all(is_same(a, b, absolute) for a, b in zip(mine, other, strict=True)):
            continue
        if on_a_seam(mine, second, state, absolute):
            seams += 1
        else:
            wrong.append((state, mine, other))
    return wrong, seams
