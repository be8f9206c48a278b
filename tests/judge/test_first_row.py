"""What is asked of the first row alone, against every trace of a few rows."""

from __future__ import annotations

from itertools import count, product
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pytest

from adeye.judge.first_row import Rows, asked_of_first_row
from adeye.judge.stl import syntax

if TYPE_CHECKING:
    from collections.abc import Iterator

    from adeye.signals import Bools

ROWS: Final = 4
WORDS: Final = ("not", "always", "eventually", "once", "historically")
BRIEF: Final = ("always soon", "eventually soon", "once soon", "historically soon")
EVERY: Final = ("always", "historically")
SPAN: Final = (0, 0)
Tree = Any
"""A number for a signal, or a word and one or two trees."""


def chains(words: tuple[str, ...], most: int) -> Iterator[Tree]:
    for length in range(most + 1):
        for chain in product(words, repeat=length):
            tree: Tree = 0
            for word in reversed(chain):
                tree = (word, tree)
            yield tree


def drawn(generator: np.random.Generator, depth: int, signals: Iterator[int]) -> Tree:
    word = str(generator.choice([*WORDS[1:], *BRIEF, *WORDS, "and", "or"]))
    if depth == 0 or generator.random() < 0.1:
        return next(signals)
    parts = 2 if word in {"and", "or"} else 1
    return (word, *(drawn(generator, depth - 1, signals) for _ in range(parts)))


def signals_of(tree: Tree) -> list[int]:
    return [tree] if isinstance(tree, int) else [at for part in tree[1:] for at in signals_of(part)]


def written(tree: Tree) -> Any:
    if isinstance(tree, int):
        return syntax.Assertion(SPAN, f"p{tree}")
    parts = [written(part) for part in tree[1:]]
    word: Any
    word, *brief = tree[0].split()
    window = syntax.Window(0.0, 1.0) if brief else None
    if word == "not":
        return syntax.Not(SPAN, *parts)
    if word in {"and", "or"}:
        return syntax.Connective(SPAN, word, *parts)
    kind: Any = syntax.Past if word in {"once", "historically"} else syntax.Temporal
    return kind(SPAN, word, window, *parts)


def held(tree: Tree, traces: Bools) -> Bools:
    """Say by the definitions at which rows a formula holds: (T, S, R) of signals to (T, R)."""
    if isinstance(tree, int):
        return traces[:, tree]
    first, *others = (held(part, traces) for part in tree[1:])
    word, *brief = tree[0].split()
    match word:
        case "not":
            return ~first
        case "and":
            return first & others[0]
        case "or":
            return first | others[0]
    fold, reach = np.all if word in EVERY else np.any, 1 if brief else ROWS
    looks_back = word in {"once", "historically"}
    parts = (
        first[:, max(0, row - reach) : row + 1] if looks_back else first[:, row : row + reach + 1]
        for row in range(ROWS)
    )
    return np.stack([fold(part, axis=1) for part in parts], axis=1)


def is_about_first(tree: Tree) -> bool | None:
    """Tell whether a signal matters at the first row alone; None if no signal matters anywhere."""
    signals = len(signals_of(tree))
    number = np.arange(2 ** (signals * ROWS))
    traces = (number[:, np.newaxis] >> np.arange(signals * ROWS)) & 1 == 1
    holds = held(tree, traces.reshape(-1, signals, ROWS))[:, 0]
    if holds.all() or not holds.any():
        return None
    flipped = (holds[number ^ (1 << place)] for place in range(signals * ROWS))
    matters = np.array([(holds != other).any() for other in flipped]).reshape(signals, ROWS)
    return bool((matters[:, 0] & ~matters[:, 1:].any(axis=1)).any())


def is_found(tree: Tree) -> bool:
    return asked_of_first_row(written(tree), Rows(1.0, ROWS - 1.0)) is not None


@pytest.mark.parametrize(("words", "most"), [(WORDS, 4), (WORDS + BRIEF, 3)])
def test_operators_over_a_signal_are_found_exactly_if_no_other_row_matters(
    words: tuple[str, ...], most: int
) -> None:
    assert [
        tree for tree in chains(words, most) if is_found(tree) is not is_about_first(tree)
    ] == []


def test_of_parts_that_are_joined_none_is_found_that_matters_later() -> None:
    generator = np.random.default_rng(20261130)
    trees = [drawn(generator, 4, count()) for _ in range(6_000)]
    found = [(tree, is_found(tree), is_about_first(tree)) for tree in trees if few(tree)]
    assert [tree for tree, is_one, should in found if is_one and should is False] == []
    missed = [tree for tree, is_one, should in found if should and not is_one]
    assert len(missed) <= 0.02 * sum(bool(should) for _, _, should in found), missed


def few(tree: Tree) -> bool:
    return 2 <= len(signals_of(tree)) <= 3
