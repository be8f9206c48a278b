"""Runs that fail a formula and its parts, and implications that were never asked."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.judge.stl import counterexample
from adeye.judge.stl.batch import HELD, NEEDED, SATISFIED, SPARE, VIOLATED
from adeye.judge.stl.counterexample import Runs, can_fail, first_constant
from adeye.judge.stl.formula import Formula, parse_formula
from adeye.judge.stl.syntax import Node, nested_implications, walk
from adeye.signals import SignalType, architecture_signals
from tests.judge.stl.batch import judge, numbers, truths
from tests.judge.stl.random_formulas import Random, text_of, traces
from tests.stored import known, stored

if TYPE_CHECKING:
    from adeye.judge.stl.batch import StlColumns

TABLES = stored("formulas")
STATUS = ("ok", "degraded", "silent", "fault")
WORDS = {"s": STATUS, "r.s": STATUS, "ch.x": STATUS}
UNITS = {"d": "m", "v": "m/s", "w": "m/s", "a": "m/s²"}
POSITIVE = {"actor.lead.distance": "m", "ttc": "s", "ch.age": "s", "time": "s"}
DECLARED = {
    **{name: SignalType("1", 1.0, "boolean", "") for name in ("p", "q")},
    **{name: SignalType("1", 1.0, "enumeration", "", labels) for name, labels in WORDS.items()},
    **{name: SignalType("1", 1.0, "number", "") for name in ("n", "k")},
    **{name: SignalType(unit, 1.0, "number", "") for name, unit in UNITS.items()},
    **{name: SignalType(unit, 1.0, "number", "", least=0.0) for name, unit in POSITIVE.items()},
    "sensor.cam.age": architecture_signals(("cam",), (), (), (), ())["sensor.cam.age"],
}
LASTING = (Runs(DECLARED, 0.1, 5.0, 0.0), Runs(DECLARED, 0.1, 20.0, 5.0))


def constant(formula: Formula) -> tuple[Node, bool] | None:
    return first_constant(formula, LASTING)


@pytest.mark.parametrize(("text", "part", "held"), TABLES["what no signal decides is found"])
def test_what_no_signal_decides_is_found(text: str, part: str, *, held: bool) -> None:
    formula = parse_formula(text)
    formula.check(DECLARED)
    found = known(constant(formula))
    assert formula.quote(found[0]).strip("()") == part.strip("()")
    assert found[1] is held


@pytest.mark.parametrize("text", TABLES["what some value decides is not found"])
def test_what_some_value_decides_is_not_found(text: str) -> None:
    assert constant(parse_formula(text)) is None


def test_one_scenario_that_lasts_long_enough_is_enough() -> None:
    formula = parse_formula("eventually(time >= 10 s)")
    assert [can_fail(formula, [item]) for item in LASTING] == [True, False]
    assert constant(formula) is None


def test_what_no_row_but_a_time_between_two_fails_is_no_constant() -> None:
    step = LASTING[0].step_s
    between = f"time <= {3 * step:g} s or time >= {4 * step:g} s"
    assert constant(parse_formula(f"always({between})")) is None
    assert constant(parse_formula(f"always({between} or time >= {3 * step:g} s)")) is not None


def test_what_is_spelt_otherwise_is_not_searched_again(monkeypatch: pytest.MonkeyPatch) -> None:
    first, again = (parse_formula(f"always(d > 7{unit})") for unit in ("00 cm", " m"))
    assert can_fail(first, LASTING)
    monkeypatch.delattr(counterexample, "_Search")
    assert can_fail(again, LASTING)


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


PLAIN_NUMBERS = {name: SignalType("1", 1.0, "number", "") for name in ("v", "a", "b", "c")}
ROWS, HORIZON = 24, 11


def drawn(random: Random, formula: Formula, runs: int) -> dict[str, Any]:
    """Draw traces of numbers that the formula is likely to be about, some of them held for long."""
    bits, shape = random.bits, (runs, ROWS)
    numbers_near = bits.choice([-2, -1, -0.5, 0, 0.25, 0.5, 0.75, 1, 1.5, 2, 3], size=shape)
    signals: dict[str, Any] = {}
    for name in formula.names:
        any_number = np.where(bits.random((runs, 1)) < 0.5, numbers_near, bits.normal(size=shape))
        holds = bits.random(shape) < bits.choice([0.0, 0.5, 0.9], size=(runs, 1))
        since = np.maximum.accumulate(np.where(holds, 0, np.arange(ROWS)), axis=1)
        values = np.take_along_axis(any_number, since, axis=1)
        signals[name] = truths(values > 0.0) if name == "p" else numbers(values)
    if "time" in signals:
        signals["time"] = numbers(np.tile(np.arange(ROWS, dtype=float), (runs, 1)), unit="s")
    return signals


def operand(random: Random, depth: int) -> str:
    """Write a random number of some signals."""
    kind = random.pick("name", "name", "number", *("+-*/" if depth else ""), "min", "max", "abs")
    if kind == "name" or (not depth and kind != "number"):
        return str(random.pick("a", "b", "c"))
    if kind == "number":
        return str(random.pick("0.5", "1", "2", "3"))
    first, second = (operand(random, depth - 1) for _ in "ab")
    if kind == "abs":
        return f"abs({first})"
    return f"{kind}({first}, {second})" if len(kind) > 1 else f"({first} {kind} {second})"


def compared(random: Random, depth: int) -> str:
    """Write a random condition about several numbers at one row."""
    if depth:
        left, right = (compared(random, depth - 1) for _ in "ab")
        return f"({left} {random.pick(*PLAIN)} {right})"
    relation = random.pick("<", "<=", ">", ">=", "==", "!=")
    term = f"{random.pick(*'abc')} {random.pick(*'+-*/')} {operand(random, 2)}"
    return f"({term} {relation} {random.pick(0, 0.5, 3)})"


def over_time(random: Random, depth: int) -> str:
    body = random.formula(depth, edges=True, past=True)
    return text_of(body, " s, ").replace("]", " s]")


WAYS: dict[str, Any] = {
    "windows": lambda random, depth: made(random, depth, ("not", *ONE), TWO),
    "numbers over time": over_time,
    "numbers at a row": compared,
}


@pytest.mark.parametrize("count", [20, pytest.param(600, marks=pytest.mark.slow)])
@pytest.mark.parametrize("way", WAYS)
def test_a_run_is_found_wherever_a_random_trace_fails(way: str, count: int) -> None:
    """Of 3 288 formulas that one of 1000 random traces fails, the search misses 1.

    It asks for two exact equalities of three signals at once; one trace fails it.
    """
    random, declared = Random(len(way)), DECLARED | PLAIN_NUMBERS
    told, missed = {True: 0, False: 0}, []
    for _ in range(count):
        text = WAYS[way](random, random.pick(1, 2, 3))
        for no in ("", "not "):
            formula = parse_formula(f"always({no}({text}))")
            traces_of = drawn(random, formula, 1000)
            result = judge(formula.text, traces_of, horizon=[HORIZON] * 1000)
            is_failed = bool((result.verdict == VIOLATED).any())
            told[is_failed] += 1
            lasting = [Runs(declared, 1.0, HORIZON, ROWS - 1 - HORIZON)]
            if is_failed and not can_fail(formula, lasting):
                missed.append(formula.text)
    assert len(missed) <= told[True] // 500, missed
    assert min(told.values()) > count // 20


MADE_UP = DECLARED | {
    "lane": SignalType("1", 1.0, "number", "", least=-3.0, most=4.0, is_whole=True),
    "age": SignalType("s", 1.0, "number", "", least=0.0, most=1.0, most_per="s"),
    "mode": SignalType("1", 1.0, "enumeration", "", ("off", "low", "high"), at_start="low"),
}
LIKE = Runs(MADE_UP, 0.1, 5.0, 1.0)


class Counting(counterexample._Search):
    """A search that keeps the runs of each batch that fail by what is judged."""

    def __init__(self, text: str) -> None:
        formula = parse_formula(text)
        formula.check(MADE_UP)
        super().__init__(formula, LIKE)
        self.failing: list[list[int]] = []
        self.sizes: list[int] = []

    def _fails(self, result: StlColumns) -> bool:
        self.failing.append(np.flatnonzero(result.verdict == VIOLATED).tolist())
        self.sizes.append(len(result.verdict))
        return super()._fails(result)


@pytest.mark.parametrize(
    ("text", "before", "failing"),
    [
        ("always(p implies eventually[0 s, 1 s] q)", 0, [0, 1, 2]),
        ("always(not (n == 3 and k == 4))", 224, [52, 118, 161]),
        ("always(not (n == 7 and k == 2 * n))", 96, [4, 32, 41]),
        ("always(not (p and s == fault and r.s == degraded and ch.x == silent))", 0, [3, 6, 9]),
        ("always(v / w < 5 or d < 3 m or a > 2 m/s^2)", 0, [24]),
        ("always(n != k + 3)", 0, [28]),
        ("always(not (n > 3 and n < 3.5 and k > 7 and k < 7.5))", 736, [140]),
        ("always(not (rise(p) and always[0 s, 2 s](p and q and n > 8)))", 0, [3, 21]),
        ("always(not (n == k * k and n > 4))", 224, [58, 149]),
        (
            "always(not (p and always[1 s, 1.4 s](not p) and eventually[1.5 s, 2 s](p)))",
            32,
            [7, 9, 13],
        ),
        (
            "always(not (n == 5 and eventually[1 s, 1.2 s](n == 6 "
            "and eventually[1 s, 1.2 s](n == 8))))",
            2528,
            [60],
        ),
        ("always(not (lane == 2 and previous(lane == 3) and age > 4 s))", 96, [69]),
        (
            "always(not (mode == high and eventually[0.2 s, 0.3 s](mode == low) and lane < -2))",
            0,
            [3, 4, 5],
        ),
        ("always(not (n > 0.5 and n < 0.50001))", 0, [4, 24]),
        ("always(not (n - k == 1.25 and n > 100))", 480, [55]),
        ("always(ttc > 3 s or ttc < 2 s or actor.lead.distance < 200 m)", 0, [16, 21, 27]),
    ],
)
def test_a_search_makes_up_the_same_runs_every_time(
    text: str, before: int, failing: list[int]
) -> None:
    """Whether an FSR is refused is no matter of luck: the runs before, and the first that fail."""
    search = Counting(text)
    assert search.succeeds()
    assert sum(search.sizes[:-1]) == before
    assert search.failing[-1][:3] == failing


@pytest.mark.parametrize(
    "text", ["always(not (lane > 1 and lane < 2))", "always(mode == low or time > 0 s)"]
)
def test_a_search_ends_when_four_thousand_runs_hold(text: str) -> None:
    search = Counting(text)
    assert not search.succeeds()
    assert search.sizes == [32, 64, 128, *[256] * 16]
    assert not any(search.failing)


def test_a_search_ends_with_one_batch_where_nothing_varies() -> None:
    search = Counting("always(time < 100 s)")
    assert not search.succeeds()
    assert search.sizes == [32]


def test_a_search_tries_what_the_formula_speaks_of() -> None:
    """Lengths are those of its times, a row more or less; numbers its own and those beside."""
    search = Counting("always(not (n > 5 and lane == 2 and age < 3 s and p and mode != high))")
    assert (search._rows, search._horizon) == (61, 50)
    assert search._lengths == [1, 2, 29, 30, 31, 32, 61]
    assert search._numbers.tolist() == [0.0, 1.0, 2.0, 3.0, 5.0]
    assert dict(zip(search._names, search._near, strict=True)) == {
        "n": [5.0, 4.0, 6.0],
        "lane": [2.0, 1.0, 3.0],
        "age": [3.0, 2.0, 4.0],
        "p": [0.0, -1.0, 1.0],
        "mode": [0.0, -1.0, 1.0],
    }
    assert search._pulls == [[(1, 1)], [(1, 1)], [(1, -1)], [(1, 1)], [(2, -1)]]
    assert search._least.ravel().tolist() == [-1e6, -3.0, 0.0, -1e6, -1e6]
    assert search._most.ravel().tolist() == [1e6, 4.0, 6.0, 1e6, 1e6]
    assert search._words.ravel().tolist() == [0, 0, 0, 2, 3]


def test_numbers_of_a_search_lie_at_between_and_beyond_those_of_the_formula() -> None:
    formula = parse_formula("always(n < 4 or n == 10 or 2 * n > 1e15 or k > 7)")
    near = counterexample._near("n", list(walk(formula.root)))
    assert near == [2.0, 4.0, 10.0, 1e12, 3.0, 7.0, 5e11 + 5.0, 1.0, 1e12 + 1.0]


def test_made_up_runs_are_frozen() -> None:
    """Three runs: one of short stretches, two of those of the formula."""
    search = Counting("always(not (n > 5 and lane == 2 and age < 3 s and p and mode == high))")
    lengths, values = search._runs = search._made_up(3, None)
    assert lengths.tolist() == [
        [1, 1, 1, 1, 2, 1, 1, 1, 2, 1, 1, 1],
        [61, 1, 29, 30, 29, 32, 58, 1, 2, 30, 61, 61],
        [31, 29, 29, 32, 32, 31, 28, 32, 29, 30, 1, 29],
    ]
    n, lane, age, p, mode = values
    assert n[0].tolist() == [110.0] * 4 + [10.0] * 8
    assert n[2].tolist() == [110.0, 10.0, *[110.0] * 5, *[11.0] * 5]
    assert (lane == 4.0).all()
    assert age[0] == pytest.approx([0.0, 0.0, *[0.8229407832154262] * 3, 2.0, *[0.0] * 6])
    assert p[0].tolist() == [1.0] * 7 + [0.0] * 5
    assert (mode == 2.0).all()
    # As rows: nothing is older than the run, and the first word is the declared one.
    first = search.series("age").values[0]
    assert first[:8] == pytest.approx([0.0, 0.0, 0.2, 0.3, 0.4, 0.5, 0.6, 0.0])
    assert search.series("mode").values[:, :3].tolist() == [[1.0, 2.0, 2.0]] * 3
    assert search.series("p").values[0].tolist() == [1.0] * 8 + [0.0] * 53
    assert search.series("n").values[2].tolist() == [110.0] * 31 + [10.0] * 29 + [110.0]
    assert search.series("time").values[1, [0, 1, 60]] == pytest.approx([0.0, 0.1, 6.0])


def test_next_runs_are_the_nearest_ones_altered_here_and_there() -> None:
    search = Counting("always(not (n > 5 and lane == 2))")
    none = np.full((1, 12), 7), np.full((2, 1, 12), -77.0)
    lengths, values = search._made_up(2000, none)
    kept = (lengths == 7).mean(axis=1), (values == -77.0).mean(axis=(0, 2))
    # Of four rates of change one is drawn for each run, and it is of both.
    for part in kept:
        assert part.mean() == pytest.approx(1.0 - (0.03 + 0.1 + 0.3 + 1.0) / 4.0, abs=0.02)
        assert np.mean(part == 0.0) == pytest.approx(0.25, abs=0.03)


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
