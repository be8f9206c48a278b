"""A parsed formula as others use it, and its check against the dictionary."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from adeye.errors import ExpressionError, SourceLocation
from adeye.judge.stl.batch import evaluate_rows
from adeye.judge.stl.formula import check_condition, parse_formula, unit_exponents
from adeye.judge.stl.parser import parse_text
from adeye.signals import SignalType, architecture_signals, scene_signals
from tests.judge.stl.batch import Signals, numbers
from tests.stored import stored

TABLES = stored("formulas")


DICTIONARY = {
    "gap": SignalType("m", 10.0, "number", "gap"),
    "a": SignalType("1", 1.0, "boolean", ""),
}


def test_a_formula_knows_its_text_names_and_reach() -> None:
    where = SourceLocation("concept.yaml", 3, 1)
    formula = parse_formula("always (a implies eventually[0 s, 2 s] gap > 2 m)", where)
    assert (formula.names, formula.reach_s, formula.where) == (("a", "gap"), 2.0, where)
    with pytest.raises(dataclasses.FrozenInstanceError):
        formula.text = "a"  # type: ignore[misc]


def test_equal_texts_give_equal_formulas() -> None:
    assert parse_formula("always gap > 2 m") == parse_formula("always gap > 2 m")


def test_a_quote_is_on_one_line() -> None:
    formula = parse_formula("always (gap\n   > 2 m)")
    assert formula.quote(formula.root) == "always (gap > 2 m)"


def test_check_passes_or_refuses_with_the_place() -> None:
    where = SourceLocation("concept.yaml", 3, 1)
    parse_formula("always (a implies gap > 2 m)").check(DICTIONARY)
    with pytest.raises(ExpressionError, match=r"concept\.yaml:3:1"):
        parse_formula("always gapp > 2 m", where).check(DICTIONARY)


@pytest.mark.parametrize(
    "text", ["once(a)", "not (b and historically[0 s, 1 s](a))", "previous(a)"]
)
def test_looking_back_from_the_first_row_only_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError, match="look back from the first row only") as caught:
        parse_formula(text)
    assert "always(" in caught.value.remedy


def test_formulas_with_other_values_of_a_parameter_are_not_taken_for_one_another() -> None:
    def judged(limit: float) -> float:
        formula = parse_formula("always(gap > limit)", parameters={"limit": (limit, (1, 0, 0))})
        series = {"gap": numbers([5.0, 4.0], unit="m")}
        low, _ = evaluate_rows(
            formula,
            Signals(series),
            step_s=1.0,
            length=np.array([2]),
            horizon=np.array([1]),
            complete=np.array([True]),
        )
        return float(low[0, 0])

    assert (judged(1.0), judged(3.0)) == (3.0, 1.0)


DICTIONARY_OF_CHECK = {
    **scene_signals(("cutter",), 3),
    **architecture_signals(("camera",), ("nominal", "safety"), ("aeb",), ("out",), ("cutter",)),
    "ttc": SignalType("s", 1.0, "number", "time to collision", cap=10.0),
    "tit": SignalType("s²", 1.0, "number", "time integrated"),
    "force": SignalType("kN", 1.0, "number", "of an unknown unit"),
}


def check(text: str) -> None:
    check_condition(parse_text(text), DICTIONARY_OF_CHECK, text)


@pytest.mark.parametrize("text", TABLES["what fits the dictionary passes"])
def test_what_fits_the_dictionary_passes(text: str) -> None:
    check(text)


@pytest.mark.parametrize(
    ("text", "column", "what", "remedy"), TABLES["what does not fit is refused with a suggestion"]
)
def test_what_does_not_fit_is_refused_with_a_suggestion(
    text: str, column: int, what: str, remedy: str
) -> None:
    with pytest.raises(ExpressionError) as caught:
        check(text)
    assert f"character {column}: " in caught.value.message
    assert what in caught.value.message
    assert remedy in caught.value.remedy


def test_units_of_signals_are_read_with_their_powers() -> None:
    assert unit_exponents("m/s²") == (1, -2, 0)
    assert unit_exponents("s²") == unit_exponents("s^2") == (0, 2, 0)
    assert unit_exponents("m³") == (3, 0, 0)
    assert unit_exponents("") == unit_exponents("1") == (0, 0, 0)
    assert unit_exponents("kg") is None
    assert unit_exponents("kg²") is None
