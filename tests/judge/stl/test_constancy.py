"""Parts of a formula that no signal decides, and implications that were never asked."""

from itertools import product
from typing import Any

import numpy as np
import pytest

from adeye.judge.stl.batch import HELD, NEEDED, SATISFIED, SPARE, VIOLATED
from adeye.judge.stl.constancy import first_constant, range_of
from adeye.judge.stl.formula import parse_formula
from adeye.judge.stl.syntax import nested_implications
from adeye.signals import SignalType
from tests.judge.stl.batch import judge, numbers, truths
from tests.judge.stl.random_formulas import Random, text_of, traces
from tests.stored import known, stored

TABLES = stored("formulas")
STATUS = ("ok", "degraded", "silent", "fault")
POSITIVE = range_of(SignalType("1", 1.0, "number", "", least=0.0))
RANGES = dict.fromkeys(("time", "ttc", "ch.age", "actor.lead.distance"), POSITIVE)
WORDS = {"s": STATUS, "r.s": STATUS, **dict.fromkeys(("p", "q"), ("false", "true"))}


@pytest.mark.parametrize(("text", "part", "held"), TABLES["what no signal decides is found"])
def test_what_no_signal_decides_is_found(text: str, part: str, *, held: bool) -> None:
    formula = parse_formula(text)
    found = known(first_constant(formula.root, WORDS, RANGES))
    assert formula.quote(found[0]).strip("()") == part.strip("()")
    assert found[1] is held


@pytest.mark.parametrize("text", TABLES["what some value decides is not found"])
def test_what_some_value_decides_is_not_found(text: str) -> None:
    assert first_constant(parse_formula(text).root, WORDS, RANGES) is None


ATOMS = ("p", "v < 1", "2 * v <= 2", "v - 1 >= 1", "time < 2 s")
PLAIN = ("and", "or", "implies")
ONE = ("rise", "fall", "previous", "once", "always[0 s, 1 s]", "eventually[1 s, 2 s]")
TWO = (*PLAIN, "until[0 s, 1 s]", "since", "since[1 s, 2 s]")


def made(random: Random, depth: int, ones: tuple[str, ...], twos: tuple[str, ...]) -> str:
    """Write a random condition."""
    if depth == 0:
        return f"({random.pick(*ATOMS)})"
    kind, parts = random.pick(*ones, *twos), [made(random, depth - 1, ones, twos) for _ in "ab"]
    return f"({parts[0]} {kind} {parts[1]})" if kind in twos else f"({kind}({parts[0]}))"


def verdicts(text: str, rows: list[Any]) -> list[set[int]]:
    """Judge a condition, and its contrary, at every row of traces of p and v."""
    p, v = np.moveaxis(np.array(rows), -1, 0)
    time = numbers(np.tile(np.arange(p.shape[1], dtype=float), (len(p), 1)), unit="s")
    signals = {"p": truths(p > 0), "v": numbers(v), "time": time}
    return [set(judge(f"always({no}({text}))", signals).verdict.tolist()) for no in ("", "not ")]


def test_what_is_called_constant_is_so_on_every_trace() -> None:
    random, told = Random(7), {True: 0, False: 0}
    values = np.array(list(product((0, 1), (0.0, 0.5, 1.0, 1.5, 2.0, 3.0))))
    rows = [values[random.bits.integers(len(values), size=5)] for _ in range(400)]
    for _ in range(900):
        text = made(random, 2, ONE, TWO)
        root = parse_formula(f"always({text})").root.operand  # type: ignore[union-attr]
        found = first_constant(root, WORDS, RANGES)
        if found is not None and found[0] is root:
            told[found[1]] += 1
            assert VIOLATED not in verdicts(text, rows)[not found[1]], text
    assert min(told.values()) > 5


def test_what_is_constant_at_every_row_is_found_where_none_speaks_of_another() -> None:
    random, told = Random(8), {True: 0, False: 0}
    values = list(product((0, 1), (-1.0, 0.0, 0.5, 1.0, 1.5, 2.0, 2.5)))
    rows = [[value, value, value] for value in values]
    for _ in range(400):
        text = made(random, 2, ("not",), PLAIN)
        root = parse_formula(f"always({text})").root.operand  # type: ignore[union-attr]
        found = first_constant(root, WORDS, RANGES)
        if found is None or found[0] is root:
            is_constant = any(VIOLATED not in item for item in verdicts(text, rows))
            assert (found is not None) is is_constant, text
            told[is_constant] += 1
    assert min(told.values()) > 15


NEVER = ("<", ("signal", "a"), ("number", -999.0))
SIGNALS = {
    "start": truths([[0, 1, 0, 0, 0, 0]]),
    "never": truths([[0, 0, 0, 0, 0, 0]]),
    "late": truths([[0, 0, 0, 0, 1, 0]]),
    "first": truths([[1, 0, 0, 0, 0, 0]]),
    "ok": truths([[1, 1, 1, 1, 1, 1]]),
}


def kinds(text: str) -> list[int]:
    """Tell what became of the nested implications of a formula that holds."""
    result = judge(text, SIGNALS)
    assert (result.verdict[0], result.vacuous[0]) == (SATISFIED, False)
    found: list[int] = result.nested[0].tolist()
    return found


@pytest.mark.parametrize("text", TABLES["it is needed where the formula holds by that alone"])
def test_it_is_needed_where_the_formula_holds_by_that_alone(text: str) -> None:
    # At the top level of always, it makes the run VACUOUS instead.
    if "(always (" not in text:
        assert kinds(text.format("never", "never")) == [NEEDED]
    assert kinds(text.format("ok", "ok")) == [HELD]


@pytest.mark.parametrize("text", TABLES["it is spare where the formula holds without it"])
def test_it_is_spare_where_the_formula_holds_without_it(text: str) -> None:
    assert kinds(text) == [SPARE]


def test_it_has_to_hold_where_it_is_asked_for() -> None:
    # Rows 1 to 3 are asked for, row 4 is none of them.
    inside = "always (rise(start) implies always[0 s, {} s] (late implies ok))"
    assert kinds(inside.format(2)) == [NEEDED]
    assert kinds(inside.format(3)) == [HELD]
    assert kinds("(late implies ok) until start") == [NEEDED]
    assert kinds("always (start implies ((late implies ok) since first))") == [NEEDED]
    assert kinds("always (start implies ((start implies ok) since first))") == [HELD]
    # The inner one is asked for only where the outer antecedent holds.
    assert kinds("always (never or (late implies (start implies ok)))") == [HELD, NEEDED]


def test_each_is_told_for_itself_in_the_order_of_the_text() -> None:
    parts = "(never implies ok) and (start implies ok) and (late implies ok)"
    assert kinds(f"always (rise(start) implies (never or {parts}))") == [NEEDED, HELD, NEEDED]
    assert kinds(f"always (ok or {parts})") == [SPARE, HELD, HELD]


def test_implications_of_the_top_level_are_none() -> None:
    text = "always ((start implies ok) and (late implies (ok implies ok)))"
    assert kinds(text) == []
    assert judge("always (never implies ok)", SIGNALS).nested.shape == (1, 0)


def test_what_is_violated_or_vacuous_tells_nothing() -> None:
    violated = judge("always (never or (never implies ok) and never)", SIGNALS)
    assert violated.nested.tolist() == [[HELD]]
    vacuous = judge("always (never implies always (never implies ok))", SIGNALS)
    assert vacuous.vacuous[0]
    assert vacuous.nested.tolist() == [[HELD]]


def planted(node: tuple[Any, ...], random: Random) -> tuple[Any, ...]:
    """Put an implication whose antecedent holds nowhere in the place of one predicate."""
    places = [at for at, part in enumerate(node) if isinstance(part, tuple) and is_condition(part)]
    if not places:
        return ("implies", NEVER, node)
    at = random.pick(*places)
    return (*node[:at], planted(node[at], random), *node[at + 1 :])


def is_condition(part: tuple[Any, ...]) -> bool:
    return isinstance(part[0], str) and part[0] not in {"signal", "number", "+", "-", "*", "abs"}


def with_consequent(node: Any, other: Any) -> Any:
    """Exchange the implication that was planted."""
    if not isinstance(node, tuple):
        return node
    if node[:2] == ("implies", NEVER):
        return other
    return tuple(with_consequent(part, other) for part in node)


@pytest.mark.slow
def test_no_consequent_matters_where_its_antecedent_never_held() -> None:
    """Laws over random formulas with one antecedent that holds nowhere."""
    random, told = Random(24), {NEEDED: 0, SPARE: 0}
    for _ in range(120):
        body = planted(random.formula(3, edges=True, past=True), random)
        text = f"eventually[0 s, 2 s] {text_of(body, ',')}"
        signals = traces(random, 6, 20)
        result = judge(text, signals, horizon=[9] * 6)
        is_told = (result.verdict == SATISFIED) & ~result.vacuous
        formula = parse_formula(text)
        lefts = [formula.quote(node.left) for node in nested_implications(formula.root)]
        if "a < -999.0" not in lefts:
            # It stands at the top level.
            continue
        place = lefts.index("a < -999.0")
        others = {
            other: judge(
                f"eventually[0 s, 2 s] {text_of(with_consequent(body, other), ',')}",
                signals,
                horizon=[9] * 6,
            ).verdict
            for other in (("implies", NEVER, NEVER), NEVER)
        }
        # What never was asked for is never held, and whatever it implies, the verdict is the same.
        np.testing.assert_array_equal(result.verdict, others["implies", NEVER, NEVER])
        kind = result.nested[:, place]
        assert (kind[is_told] != HELD).all()
        assert (kind[~is_told] == HELD).all()
        alone = is_told & ((result.nested != HELD).sum(axis=1) == 1)
        needed = others[NEVER] != SATISFIED
        np.testing.assert_array_equal(kind[alone] == NEEDED, needed[alone])
        for word in told:
            told[word] += int((kind[alone] == word).sum())
    assert min(told.values()) > 20
