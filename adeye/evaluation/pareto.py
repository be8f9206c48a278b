"""What is worth choosing among candidates that are measured in several ways at once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


@dataclass(frozen=True, slots=True)
class Objective:
    """One way to measure a candidate.

    Attributes:
        name: What it is called.
        better: Which way is better.
        epsilon: Difference that does not count; 0: every one does.
    """

    name: str
    better: Literal["lower", "higher"]
    epsilon: float = 0.0


def dominators(
    candidates: Mapping[str, Sequence[float]], objectives: Sequence[Objective]
) -> dict[str, str | None]:
    """Find for each candidate one on the front that is at least as good in everything.

    With an epsilon, values are compared by the box of that size that they lie in; candidates in
    the same boxes are compared exactly. That keeps the relation transitive: whoever is dominated
    has a dominator that nobody dominates. Candidates that are equal in everything stay both.

    Args:
        candidates: Values by name, one for each objective.
        objectives: What the values mean.

    Returns:
        Dominator by name, None on the front. Of several, it is the one that is best in the first
        objective, then the second and so on, then the first by name.

    Raises:
        ValueError: A value is not finite, or an epsilon is negative.

    Source:
        Laumanns, Thiele, Deb, Zitzler (2002), "Combining convergence and diversity in evolutionary
        multiobjective optimization", definition 4: additive boxes.

    >>> costs = [Objective("failures", "lower"), Objective("cost", "lower")]
    >>> dominators({"a": (0, 9), "b": (3, 4), "c": (3, 6)}, costs)
    {'a': None, 'b': None, 'c': 'b'}
    """
    losses = {name: _losses(name, values, objectives) for name, values in candidates.items()}
    boxes = {
        name: tuple(
            math.floor(loss / item.epsilon) if item.epsilon > 0.0 else loss
            for loss, item in zip(values, objectives, strict=True)
        )
        for name, values in losses.items()
    }

    def beats(one: str, other: str) -> bool:
        if boxes[one] != boxes[other]:
            return _is_no_worse(boxes[one], boxes[other])
        return losses[one] != losses[other] and _is_no_worse(losses[one], losses[other])

    front = [
        name for name in candidates if not any(beats(other, name) for other in candidates)
    ]  # fmt: skip
    front.sort(key=lambda name: (losses[name], name))
    return {
        name: None if name in front else next(other for other in front if beats(other, name))
        for name in candidates
    }


def _losses(
    name: str, values: Sequence[float], objectives: Sequence[Objective]
) -> tuple[float, ...]:
    """Turn values so that lower is better in all."""
    losses = []
    for value, item in zip(values, objectives, strict=True):
        if not math.isfinite(value):
            msg = f"{name}: {item.name} is {value}"
            raise ValueError(msg)
        if not 0.0 <= item.epsilon < math.inf:
            msg = f"epsilon of {item.name} is {item.epsilon}"
            raise ValueError(msg)
        losses.append(float(value) if item.better == "lower" else -float(value))
    return tuple(losses)


def _is_no_worse(one: Sequence[float], other: Sequence[float]) -> bool:
    return all(mine <= theirs for mine, theirs in zip(one, other, strict=True))
