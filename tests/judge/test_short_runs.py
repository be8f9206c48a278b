"""What parts of formulas say together, against runs of more rows than are looked at."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pytest

from adeye.judge.first_row import Rows
from adeye.judge.short_runs import fail_alike, uncounted
from adeye.judge.stl import syntax
from adeye.judge.stl.formula import parse_formula

if TYPE_CHECKING:
    from adeye.signals import Bools

EVERY: Final = ("always", "historically")
PAST: Final = ("once", "historically", "once soon", "historically soon")
ROWWISE: Final = ("previous", "rise", "fall")
JOINED: Final = ("and", "or", "implies", "since")
SOON: Final = 2
HORIZON: Final = 4
TAIL: Final = 2
DRAWN: Final = 80


Tree = Any
"""A number for a signal, or a word and one or two trees."""


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


@pytest.mark.parametrize(
    ("one", "other", "is_same"),
    [
        ("always(not p)", "not eventually(p)", True),
        ("always(p implies q)", "always(not p or q)", True),
        ("always(x > 5)", "not eventually(5 >= x)", True),
        ("always(p and q)", "always(p) and always(q)", True),
        ("always(once(p) or q)", "always(q or once(p == true))", True),
        ("always(p)", "always(q)", False),
        ("always(p implies eventually[0 s, 1 s](q))", "always(p implies q)", False),
        ("always(p implies q)", "always(q implies p)", False),
        ("always(a and b and c) and always(d or e or f or g)", "always(a or h)", None),
    ],
)
def test_formulas_are_alike_if_they_fail_on_the_same_runs(
    one: str, other: str, is_same: object
) -> None:
    first, second = (parse_formula(text).root for text in (one, other))
    assert fail_alike(first, second, Rows(0.1, 1e6)) is is_same
