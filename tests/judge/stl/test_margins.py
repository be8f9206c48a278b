"""The margin of an FSR: what it asks for, at the rows at which its precondition held.

The oracles judge precondition and consequent apart and know nothing of implications.
"""

import itertools
from typing import Any

import numpy as np
import pytest

from adeye.judge.stl.series import Series
from tests.judge.stl.batch import binding, judge, numbers, standing, truths
from tests.judge.stl.random_formulas import NAMES, Random, Reference, text_of, traces
from tests.judge.stl.test_profile import of_rtamt, rtamt_rows

ROWS, HORIZON, BATCH = 40, 15, 4
SHAPES = ("always ({0} implies {1})", "always (b < 9 implies ({0} implies {1}))",
          "always (({0} implies {1}) and (c > 9 or {1} or not {0}))")  # fmt: skip


def consequent(random: Random, **options: bool) -> Any:
    """Make what a precondition asks for; one that is an implication would be one more of them."""
    found = random.formula(2, **options)
    return ("not", found) if found[0] == "implies" else found


def least(held: np.ndarray, worth: np.ndarray) -> float:
    return min((w for h, w in zip(held, worth, strict=True) if h), default=np.nan)


def compare(text: str, signals: dict[str, Series], held: np.ndarray, worth: np.ndarray) -> int:
    """Compare margins with the least that the consequent is worth at the rows that count."""
    result = judge(text, signals, horizon=[HORIZON] * BATCH)
    for run in range(BATCH):
        expected = least(held[run], worth[run])
        is_vacuous = standing(result, run) == "vacuous"
        assert is_vacuous == np.isnan(expected), text
        if is_vacuous:
            continue
        margin = binding(result, run).difference
        # Before the first row there is nothing: false, and no distance from true.
        assert (margin is None) == np.isinf(expected), text
        assert margin is None or margin == pytest.approx(expected, abs=1e-9), text
        assert (expected < 0.0) == (standing(result, run) == "violated"), text
    return BATCH


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_it_is_the_least_that_the_consequent_is_worth_where_the_precondition_held(
    seed: int,
) -> None:
    random = Random(900 + seed)
    for _ in range(60):
        before, after = random.formula(1), consequent(random)
        signals = traces(random, BATCH, ROWS)
        values = [{name: signals[name].values[run] for name in NAMES} for run in range(BATCH)]
        rows = range(HORIZON + 1)
        held = [
            [Reference(v, ROWS, is_boolean=True).bound(before, k, -1) > 0.0 for k in rows]
            for v in values
        ]
        worth = [[Reference(v, ROWS).bound(after, k, -1) for k in rows] for v in values]
        text = random.pick(*SHAPES[:2]).format(text_of(before, ","), text_of(after, ","))
        compare(text, signals, np.array(held), np.array(worth))


def test_it_is_what_rtamt_finds_for_precondition_and_consequent_apart() -> None:
    random, compared = Random(77), 0
    for shape, _ in itertools.product(SHAPES[:2], range(20)):
        before, after = random.formula(1, past=True), consequent(random, past=True)
        signals = traces(random, BATCH, ROWS)
        rows = slice(0, HORIZON + 1)
        held = rtamt_rows(of_rtamt(before), signals)[:, rows] > 0.0
        worth = rtamt_rows(of_rtamt(after), signals)[:, rows]
        text = shape.format(text_of(before, ","), text_of(after, ","))
        compared += compare(text, signals, held, worth)
    assert compared == 160


@pytest.mark.parametrize("shape", SHAPES)
def test_verdict_and_robustness_are_those_of_the_whole_formula(shape: str) -> None:
    """Written with ``or`` there is no precondition, and all else is the same."""
    random = Random(5)
    for _ in range(40):
        before, after = (text_of(random.formula(1), ",") for _ in range(2))
        signals = traces(random, BATCH, ROWS)
        plain = shape.replace("{0} implies {1}", "not {0} or {1}").replace("b < 9 implies", "")
        one = judge(shape.format(before, after), signals, horizon=[HORIZON] * BATCH)
        other = judge(plain.format(before, after), signals, horizon=[HORIZON] * BATCH)
        assert one.verdict.tolist() == other.verdict.tolist()
        whole = one.robustness_low
        if "b < 9" in shape:
            whole = np.minimum(whole, other.robustness_low)
        assert whole.tolist() == other.robustness_low.tolist()


def test_a_precondition_that_nearly_held_is_no_margin() -> None:
    signals = {
        "speed": numbers([4.9, 6.0, 8.0], unit="m/s"),
        "gap": numbers([1.0, 9.0, 7.0], unit="m"),
    }
    result = judge("always (speed > 5 m/s implies gap > 2 m)", signals)
    found = binding(result)
    assert (found.text, found.row, found.difference) == ("gap > 2 m", 2, 5.0)
    assert result.robustness_low[0] == pytest.approx(0.1)


def test_a_whole_formula_as_precondition_counts_as_one_at_a_row_does() -> None:
    signals = {"fault": truths([0, 1, 0]), "gap": numbers([9.0, 5.0, 3.0], unit="m")}
    found = binding(judge("eventually (fault) implies always (gap > 2 m)", signals))
    assert (found.text, found.row, found.difference) == ("gap > 2 m", 2, 1.0)


def test_of_several_requirements_the_one_that_is_met_most_narrowly_counts() -> None:
    signals = {
        "a": truths([0, 1]),
        "gap": numbers([1.0, 9.0], unit="m", scale=10.0),
        "speed": numbers([1.0, 2.0], unit="m/s"),
    }
    found = binding(judge("always ((a implies gap > 2 m) and speed < 3 m/s)", signals))
    assert (found.text, found.difference) == ("gap > 2 m", 7.0)


def test_what_any_row_may_meet_has_the_margin_of_the_row_that_met_it() -> None:
    signals = {"a": numbers([1.0, 1.0]), "b": numbers([3.0, 5.0])}
    found = binding(judge("eventually (a > 0 implies b > 1)", signals))
    assert (found.text, found.row, found.difference) == ("b > 1", 1, 4.0)
