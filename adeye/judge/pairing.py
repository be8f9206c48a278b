"""Pairs of results on the same test case: who met whom, and how their verdicts go together."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from adeye.judge.verdict import FAIL, PASS, VACUOUS, VERDICTS

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats, Ints

# --- Pairs of results on the same test case: who met whom, and how their verdicts go together -----

NOT_RUN: Final = len(VERDICTS)
"""Code of a planned case without a result; the codes below are those of ``VERDICTS``."""
NOT_JUDGED: Final = -1
"""Code where an FSR is not applicable, or the case lies where it is not asked for."""

HELD, UNDECIDED, FAILED = range(3)
"""What a verdict says about failing: VACUOUS did not fail, and is counted apart from PASS."""
_SEVERITY: Final = np.array(
    [
        *(
            {PASS: HELD, VACUOUS: HELD, FAIL: FAILED}.get(code, UNDECIDED)
            for code in range(len(VERDICTS))
        ),
        UNDECIDED,
        NOT_JUDGED,
    ],
    dtype=np.int64,
)
"""By code of a verdict; the last entry is that of ``NOT_JUDGED``."""


def severities(verdicts: Ints) -> Ints:
    """Tell of each verdict whether it failed, held or is undecided.

    Args:
        verdicts: Codes of any shape.

    Returns:
        ``HELD``, ``UNDECIDED``, ``FAILED`` or ``NOT_JUDGED`` in that shape.
    """
    found: Ints = _SEVERITY[verdicts]
    return found


def pair_up(first: Ints, second: Ints) -> tuple[Ints, Ints]:
    """Find all pairs of rows with the same key.

    Args:
        first: (N,) keys.
        second: (M,) keys.

    Returns:
        Rows (P,) of the first and of the second, in the order of the first.
    """
    order = np.argsort(second, kind="stable")
    ranked = second[order]
    low = np.searchsorted(ranked, first, "left")
    counts = np.searchsorted(ranked, first, "right") - low
    rows = np.repeat(np.arange(len(first)), counts)
    within = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
    return rows, order[np.repeat(low, counts) + within]


def number_rows(*columns: Ints) -> Ints:
    """Number the different rows of some columns of codes.

    Args:
        columns: (N,) each.

    Returns:
        (N,) codes from 0, the same where all columns are.
    """
    codes = np.zeros(len(columns[0]), dtype=np.int64)
    for column in columns:
        _, found = np.unique(column, return_inverse=True)
        _, codes = np.unique(codes * (found.max(initial=0) + 1) + found, return_inverse=True)
    return codes.astype(np.int64)


@dataclass(frozen=True, slots=True)
class Counts:
    """Pairs of verdicts of one FSR; they add up to all pairs that are judged.

    Attributes:
        both_pass: Both PASS.
        only_a_fails: A FAIL, B PASS or VACUOUS.
        only_b_fails: B FAIL, A PASS or VACUOUS.
        both_fail: Both FAIL.
        neutral: No FAIL and at least one VACUOUS.
        undecided: At least one INCONCLUSIVE, INVALID, ERROR or NOT_RUN.
    """

    both_pass: int
    only_a_fails: int
    only_b_fails: int
    both_fail: int
    neutral: int
    undecided: int

    @property
    def pairs(self) -> int:
        """All pairs that are judged."""
        return self.decided + self.undecided

    @property
    def decided(self) -> int:
        """Pairs of which is known for both whether they failed."""
        return (
            self.both_pass + self.only_a_fails + self.only_b_fails + self.both_fail + self.neutral
        )


def verdict_table(a: Ints, b: Ints) -> Ints:
    """Count pairs of verdicts.

    Args:
        a: (P,) codes; pairs with ``NOT_JUDGED`` are left out.
        b: (P,) codes.

    Returns:
        (7, 7) counts by code of A and of B.
    """
    size = NOT_RUN + 1
    is_judged = (a >= 0) & (b >= 0)
    flat = np.bincount(a[is_judged] * size + b[is_judged], minlength=size * size)
    return flat.reshape(size, size).astype(np.int64)


def counts_of(table: Ints) -> Counts:
    """Sum a table of verdicts.

    Args:
        table: (7, 7) as of ``verdict_table``.
    """
    kind = _SEVERITY[:-1]
    a, b = kind[:, np.newaxis], kind[np.newaxis, :]

    def count(mask: Bools) -> int:
        return int(table[mask].sum())

    is_open = (a == UNDECIDED) | (b == UNDECIDED)
    both_held = (a == HELD) & (b == HELD)
    both_pass = int(table[PASS, PASS])
    return Counts(
        both_pass=both_pass,
        only_a_fails=count((a == FAILED) & (b == HELD)),
        only_b_fails=count((a == HELD) & (b == FAILED)),
        both_fail=count((a == FAILED) & (b == FAILED)),
        neutral=count(both_held) - both_pass,
        undecided=count(is_open),
    )


@dataclass(frozen=True, eq=False)
class Groups:
    """Rows gathered by what they belong to.

    Attributes:
        order: (N,) rows, those of one group together.
        starts: (G,) where each group begins.
        keys: (G,) what it is.
    """

    order: Ints
    starts: Ints
    keys: Ints

    @classmethod
    def of(cls, keys: Ints) -> Groups:
        """Gather rows (N,) by key."""
        order = np.argsort(keys, kind="stable")
        found, starts = np.unique(keys[order], return_index=True)
        return cls(order, starts.astype(np.int64), found)

    def worst(self, severity: Ints) -> Ints:
        """Fold severities (N, ...) to the worst of each group (G, ...)."""
        worst: Ints = np.maximum.reduceat(severity[self.order], self.starts, axis=0)
        return worst

    def mean(self, values: Floats) -> Floats:
        """Average values (N, ...) over each group (G, ...), those that are NaN left out."""
        given = values[self.order]
        known = np.isfinite(given)
        sums = np.add.reduceat(np.where(known, given, 0.0), self.starts, axis=0)
        counts = np.add.reduceat(known.astype(np.int64), self.starts, axis=0)
        return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


# --- What is worth choosing among candidates that are measured in several ways at once ------------


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
