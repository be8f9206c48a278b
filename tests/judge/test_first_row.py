"""What is asked of the first row alone, against every trace of a few rows."""

from __future__ import annotations

from itertools import count, product
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pytest

from adeye.judge.first_row import Rows, asked_of_first_row, uncounted
from adeye.judge.stl import syntax
from adeye.judge.stl.formula import parse_formula

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


# --- Parts that say it together -------------------------------------------------------------------

PAST: Final = ("once", "historically", "once soon", "historically soon")
ROWWISE: Final = ("previous", "rise", "fall")
JOINED: Final = ("and", "or", "implies", "since")
SOON: Final = 2
HORIZON: Final = 4
TAIL: Final = 2
DRAWN: Final = 80


def joined(generator: np.random.Generator, depth: int, *, may_look_ahead: bool = True) -> Tree:
    """Draw a tree over two signals, each of which may come again."""
    if depth == 0 or generator.random() < 0.15:
        return int(generator.integers(2))
    ahead = ("always soon", "eventually soon") if may_look_ahead else ()
    word = str(generator.choice([*JOINED, *JOINED, "not", *PAST, *ROWWISE, *ahead]))
    may = may_look_ahead and word not in ahead
    parts = 2 if word in JOINED else 1
    return (word, *(joined(generator, depth - 1, may_look_ahead=may) for _ in range(parts)))


def text_of(tree: Tree) -> str:
    if isinstance(tree, int):
        return f"p{tree}"
    word, *brief = tree[0].split()
    parts = [f"({text_of(part)})" for part in tree[1:]]
    window = f"[0 s, {SOON} s]" if brief else ""
    return f" {word} ".join(parts) if len(parts) == 2 else f"{word}{window}{parts[0]}"


def told(tree: Tree, traces: Bools) -> Bools:
    """Say by the definitions at which rows a tree holds; those behind the last are never read."""
    if isinstance(tree, int):
        return traces[:, tree]
    first, *others = (told(part, traces) for part in tree[1:])
    word, *brief = tree[0].split()
    rows = first.shape[1]
    before = np.pad(first, ((0, 0), (1, 0)))[:, :rows]
    is_later = np.arange(rows) > 0
    if others:
        found = others[0].copy()
        for row in range(1, rows):
            found[:, row] |= first[:, row] & found[:, row - 1]
        joint = {"and": first & others[0], "or": first | others[0], "implies": ~first | others[0]}
        return joint.get(word, found)
    if word in {"not", *ROWWISE}:
        rise, fall = first & ~before & is_later, ~first & before & is_later
        return {"not": ~first, "previous": before, "rise": rise, "fall": fall}[word]
    fold, reach = np.all if word in EVERY else np.any, SOON if brief else rows
    looks_back = word in {"once", "historically"}
    parts = (
        first[:, max(0, row - reach) : row + 1] if looks_back else first[:, row : row + reach + 1]
        for row in range(rows)
    )
    return np.stack([fold(part, axis=1) for part in parts], axis=1)


def test_what_parts_say_together_is_found_if_every_run_agrees() -> None:
    generator, rows = np.random.default_rng(7), HORIZON + TAIL + 1
    number = np.arange(2 ** (2 * rows))
    traces = ((number[:, np.newaxis] >> np.arange(2 * rows)) & 1 == 1).reshape(-1, 2, rows)
    missed = wanted = found = 0
    for _ in range(DRAWN):
        word, tree = generator.choice(["always", "eventually"]), joined(generator, 3)
        root = parse_formula(f"{word}({text_of(tree)})").root
        part = uncounted(root, Rows(1.0, rows - 1.0))
        fold = np.all if word == "always" else np.any
        holds = np.asarray(fold(told(tree, traces)[:, : HORIZON + 1], axis=1), dtype=np.int8)
        cube = np.reshape(holds, (2,) * (2 * rows))
        # The first axis is the last place.
        decides = [np.ptp(cube, axis=2 * rows - 1 - place).any() for place in range(2 * rows)]
        counts = np.reshape(decides, (2, rows))
        named = {int(name[1:]) for name in syntax.names_in(root)}
        lonely = {signal for signal in named if not counts[signal, 1:].any()}
        if part is None:
            missed += bool(lonely - conditions(root))
        else:
            ((name,), at_first), found = (syntax.names_in(part[0]), part[1]), found + 1
            assert int(name[1:]) in lonely, text_of(tree)
            assert at_first is bool(counts[int(name[1:]), 0]), text_of(tree)
        wanted += bool(lonely - conditions(root))
    assert found > DRAWN / 20
    assert missed <= 0.05 * wanted


def conditions(root: syntax.Condition) -> set[int]:
    """List the signals that imply something: those may be about the start."""
    implied = (part for part in syntax.walk(root) if syntax.head_of(part) == "implies")
    named = (syntax.names_in(syntax.children(part)[0]) for part in implied)
    return {int(name[1:]) for names in named for name in names}


@pytest.mark.parametrize(
    "text",
    [
        "always(previous(p) or once(p))",
        "always(fall(p) or once(p == true))",
        "always(x > 5 or previous(5 >= x) or once(not x <= 5))",
        "always(q and (once(p) or previous(q)))",
    ],
)
def test_parts_in_other_spellings_are_the_same(text: str) -> None:
    found = uncounted(parse_formula(text).root, Rows(0.1, 12.0))
    assert found is not None
    assert found[1]


@pytest.mark.parametrize(
    "text",
    [
        "always[0 s, 10 s](always[0 s, 10 s](once[0 s, 15 s](p)))",
        "eventually[0 s, 1 s](previous(p))",
        "always(p implies eventually[0 s, 2 s](q))",
        "p implies always(q)",
        "always(a and b and c and d or previous(e) and once(f))",
        "always(time >= 2 s implies p)",
    ],
)
def test_what_counts_later_is_not_found(text: str) -> None:
    assert uncounted(parse_formula(text).root, Rows(0.1, 30.0)) is None
