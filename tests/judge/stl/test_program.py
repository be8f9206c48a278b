"""Numbered formulas: parts come before wholes, and the same formula is numbered once."""

import numpy as np

from adeye.judge.stl.formula import parse_formula
from adeye.judge.stl.program import (
    ALWAYS,
    COMPARE,
    FIRST_PART,
    FROM_ROW,
    HAS_WINDOW,
    IMPLIES,
    IS_START,
    KIND,
    LOWER_CAP,
    SCALE,
    SECOND_PART,
    SIGNAL,
    TO_ROW,
    UPPER_CAP,
    WORD,
    Program,
    compile_formula,
)
from adeye.judge.stl.series import Series
from tests.judge.stl.batch import numbers, truths, words

INPUTS = {
    "gap": numbers([0.0], unit="m", scale=10.0, cap=200.0),
    "speed": numbers([0.0], unit="m/s", scale=5.0),
    "contact": truths([0]),
    "a.status": words([0], "ok", "silent"),
}


def compiled(text: str, step_s: float = 0.5) -> Program:
    formula = parse_formula(text)
    inputs: dict[str, Series] = {name: INPUTS[name] for name in formula.names}
    return compile_formula(formula, inputs, step_s)


def test_parts_come_before_what_uses_them() -> None:
    program = compiled("always (contact implies eventually[0 s, 1 s] gap - 2 * gap > abs(gap) * 3)")
    for node, row in enumerate(program.tables.nodes):
        if row[KIND] > WORD:
            assert max(row[FIRST_PART], row[SECOND_PART]) < node
        else:
            assert max(row[FIRST_PART], row[SECOND_PART]) < len(program.tables.terms)
    for term, (operation, first, second) in enumerate(program.tables.terms):
        if operation == SIGNAL:
            assert first < len(program.names)
        else:
            assert max(first, second) <= term


def test_the_last_condition_is_the_formula() -> None:
    program = compiled("always (contact implies gap > 2 m)")
    assert program.tables.nodes[-1, KIND] == ALWAYS
    assert program.words[-1].text == "always (contact implies gap > 2 m)"
    assert program.tables.nodes[-2, KIND] == IMPLIES


def test_a_window_is_counted_in_rows() -> None:
    program = compiled("eventually[1 s, 2.5 s] contact")
    row = program.tables.nodes[-1]
    assert (row[HAS_WINDOW], row[FROM_ROW], row[TO_ROW]) == (1, 2, 5)
    assert compiled("eventually contact").tables.nodes[-1, HAS_WINDOW] == 0


def test_connectives_outside_temporal_operators_are_judged_as_whole_formulas() -> None:
    program = compiled("(eventually contact) and not (always gap > 2 m)")
    starts = {
        seen.text: bool(row[IS_START])
        for seen, row in zip(program.words, program.tables.nodes, strict=True)
    }
    assert starts["eventually contact"]
    assert not starts["contact"]
    assert not starts["gap > 2 m"]


def test_a_predicate_has_the_scale_and_caps_of_its_difference() -> None:
    (limits,) = compiled("gap > 2 m").tables.limits
    assert limits[SCALE] == 10.0
    assert (limits[LOWER_CAP], limits[UPPER_CAP]) == (-np.inf, 200.0)
    (limits,) = compiled("gap < 2 m").tables.limits
    assert (limits[LOWER_CAP], limits[UPPER_CAP]) == (-200.0, np.inf)
    (limits,) = compiled("3 * gap > 2 m").tables.limits
    assert (limits[SCALE], limits[UPPER_CAP]) == (30.0, 600.0)
    (limits,) = compiled("speed * 0 > 0 m/s").tables.limits
    assert limits[SCALE] == 1.0


def test_people_see_numbers_of_numbers_and_words_of_words() -> None:
    (seen,) = compiled("gap > 2 m").words
    assert (seen.text, seen.signal, seen.unit, seen.values) == ("gap > 2 m", "gap", "m", ())
    assert (seen.is_value_shown, seen.is_threshold_shown) == (True, True)
    (seen,) = compiled("a.status == silent").words
    assert (seen.signal, seen.unit, seen.values) == ("a.status", "", ("ok", "silent"))
    assert (seen.is_value_shown, seen.is_threshold_shown) == (False, False)
    (seen,) = compiled("contact").words
    assert (seen.values, seen.is_value_shown) == (("false", "true"), True)


def test_every_implication_at_the_top_has_its_antecedents() -> None:
    program = compiled("always[0.5 s, 1 s] ((contact implies speed > 1) and (contact implies "
                       "(gap > 2 m implies speed > 2)))".replace("> 1)", "> 1 m/s)")
                       .replace("> 2))", "> 2 m/s))"))  # fmt: skip
    assert program.tables.implied.tolist() == [[0, 1, 1, 1, 2], [1, 2, 1, 1, 2]]
    texts = [program.words[node].text for node in program.tables.antecedents]
    assert texts == ["contact", "contact", "gap > 2 m"]
    assert compiled("contact implies gap > 2 m").tables.implied.tolist() == [[0, 1, 0, 0, -1]]
    assert compiled("contact or gap > 2 m").tables.implied.shape == (0, 5)


def test_the_same_formula_is_numbered_once_for_each_step() -> None:
    text = "always[0 s, 1 s] gap > 2 m"
    assert compiled(text) is compiled(text)
    assert compiled(text, 0.5) is not compiled(text, 0.25)


def test_another_declaration_is_another_program() -> None:
    formula = parse_formula("gap > 2 m")
    one = compile_formula(formula, {"gap": numbers([0.0], unit="m")}, 0.5)
    other = compile_formula(formula, {"gap": numbers([0.0], unit="m", scale=2.0)}, 0.5)
    assert (one.tables.limits[0, SCALE], other.tables.limits[0, SCALE]) == (1.0, 2.0)
    assert one.tables.nodes[0, KIND] == COMPARE
