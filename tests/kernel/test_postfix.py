"""The stack machine: hand-made programs with their answers; what is undefined is never true."""

from __future__ import annotations

import math

import numpy as np
import pytest

from adeye.kernel import postfix
from adeye.kernel.elementary import cos, exp, log, sin

CODES = postfix.OPERATOR_CODES | postfix.FUNCTION_CODES
NAN, INF = math.nan, math.inf


def run(*words: float | str, variables: tuple[float, ...] = ()) -> float:
    """Run a program of numbers, `$0` for the first variable, and names of operations."""
    ops, args = [], []
    for word in words:
        if not isinstance(word, str):
            ops.append(postfix.PUSH_NUMBER)
            args.append(float(word))
        elif word.startswith("$"):
            ops.append(postfix.PUSH_VARIABLE)
            args.append(float(word[1:]))
        else:
            ops.append(CODES[word])
            args.append(0.0)
    return postfix.run_program(
        np.array(ops, dtype=np.int64), np.array(args), np.array(variables, dtype=np.float64)
    )


def same(found: float, wanted: float) -> bool:
    """Tell whether two numbers are equal, with the sign of zero, or both NaN."""
    if math.isnan(wanted):
        return math.isnan(found)
    return found == wanted and math.copysign(1.0, found) == math.copysign(1.0, wanted)


def test_codes_are_different() -> None:
    codes = [postfix.PUSH_NUMBER, postfix.PUSH_VARIABLE, *CODES.values()]
    assert (
        len(set(codes))
        == len(codes)
        == len(postfix.OPERATOR_CODES) + len(postfix.FUNCTION_CODES) + 2
    )


OF_TWO = [
    ("+", 2.0, 3.0, 5.0),
    ("-", 2.0, 3.0, -1.0),
    ("*", 2.0, 3.0, 6.0),
    ("/", 3.0, 2.0, 1.5),
    ("/", 1.0, 0.0, INF),
    ("/", -1.0, 0.0, -INF),
    ("/", 1.0, -0.0, -INF),
    ("/", 0.0, 0.0, NAN),
    ("/", NAN, 0.0, NAN),
    ("+", INF, -INF, NAN),
    ("*", 1e308, 10.0, INF),
    ("**", 2.0, 10.0, 1024.0),
    ("**", -2.0, 3.0, -8.0),
    ("**", -2.0, 2.0, 4.0),
    ("**", -2.0, -1.0, -0.5),
    ("**", -2.0, 0.5, NAN),
    ("**", 0.0, -1.0, INF),
    ("**", NAN, 0.0, NAN),
    ("**", 0.0, NAN, NAN),
    ("**", 1e300, 2.0, INF),
    ("min", 2.0, 3.0, 2.0),
    ("min", 3.0, 2.0, 2.0),
    ("min", NAN, 2.0, NAN),
    ("min", 2.0, NAN, NAN),
    ("max", 2.0, 3.0, 3.0),
    ("max", NAN, 2.0, NAN),
    ("max", 2.0, NAN, NAN),
    ("and", 1.0, 2.0, 1.0),
    ("and", 1.0, 0.0, 0.0),
    ("and", 1.0, NAN, 0.0),
    ("or", 0.0, -1.0, 1.0),
    ("or", 0.0, 0.0, 0.0),
    ("or", 0.0, NAN, 0.0),
    ("==", 0.0, -0.0, 1.0),
    ("!=", 1.0, 2.0, 1.0),
    ("!=", 1.0, 1.0, 0.0),
    ("!=", INF, INF, 0.0),
    ("<", 1.0, 2.0, 1.0),
    ("<", 2.0, 2.0, 0.0),
    ("<=", 2.0, 2.0, 1.0),
    ("<=", 3.0, 2.0, 0.0),
    (">", 2.0, 1.0, 1.0),
    (">", 2.0, 2.0, 0.0),
    (">=", 2.0, 2.0, 1.0),
    (">=", 1.0, 2.0, 0.0),
]


def test_operation_of_two() -> None:
    for word, left, right, answer in OF_TWO:
        assert same(run(left, right, word), answer), (word, left, right)


def test_comparison_with_nan_is_false() -> None:
    for word in ("==", "!=", "<", "<=", ">", ">="):
        for left, right in ((NAN, 1.0), (1.0, NAN), (NAN, NAN)):
            assert run(left, right, word) == 0.0


OF_ONE = [
    ("not", 0.0, 1.0),
    ("not", 2.0, 0.0),
    ("not", NAN, 0.0),
    ("negative", 2.0, -2.0),
    ("abs", -2.0, 2.0),
    ("sqrt", 9.0, 3.0),
    ("sqrt", -1.0, NAN),
    ("floor", 1.5, 1.0),
    ("floor", -1.5, -2.0),
    ("floor", 1e300, 1e300),
    ("floor", -INF, -INF),
    ("ceil", 1.5, 2.0),
    ("ceil", 1e300, 1e300),
    ("sin", 0.5, sin(0.5)),
    ("sin", INF, NAN),
    ("cos", 0.5, cos(0.5)),
    ("exp", 1.0, exp(1.0)),
    ("exp", 709.5, exp(709.5)),
    ("exp", 1000.0, INF),
    ("log", 2.0, log(2.0)),
    ("log", 0.0, -INF),
    ("log", -1.0, NAN),
]


@pytest.mark.slow
def test_operation_of_one() -> None:
    for word, value, answer in OF_ONE:
        assert same(run(value, word), answer), (word, value)
        assert same(postfix.unary(CODES[word], value), answer), (word, value)


def test_number_computed_from_nan_is_nan() -> None:
    for word in ("negative", "abs", "sqrt", "floor", "ceil", "sin", "cos", "exp", "log"):
        assert math.isnan(run(NAN, word))


def test_clip_choice_and_membership() -> None:
    for value, answer in ((5.0, 3.0), (-5.0, 0.0), (2.0, 2.0), (NAN, NAN)):
        assert same(run(value, 0.0, 3.0, "clip"), answer), value
    # A choice takes its branch and is undefined with its condition.
    for condition, answer in ((1.0, 7.0), (-0.5, 7.0), (0.0, 8.0), (NAN, NAN)):
        assert same(run(condition, 7.0, 8.0, "if_"), answer), condition
    for value, answer in ((2.0, 1.0), (3.0, 1.0), (4.0, 0.0), (NAN, 0.0)):
        program = (value, 0.0, 2.0, "member", 3.0, "member", "found")
        assert run(*program) == answer, value
        assert run(10.0, *program, "+") == 10.0 + answer, value


def test_variables_are_taken_by_position() -> None:
    assert run("$1", "$0", "-", variables=(2.0, 10.0)) == 8.0


def test_stack_may_be_full() -> None:
    assert run(*[1.0] * postfix.MAX_STACK, *["+"] * (postfix.MAX_STACK - 1)) == float(
        postfix.MAX_STACK
    )


def test_columns_are_the_scalars_in_a_row() -> None:
    values = np.array([-1.0, 0.0, 0.5, 2.0, NAN, INF])
    code = CODES["log"]
    wanted = np.array([postfix.unary(code, float(value)) for value in values])
    np.testing.assert_array_equal(postfix.unary_column(code, values), wanted)
    powers = np.array([2.0, 3.0, 0.5, -1.0, 1.0, 2.0])
    raised = np.array([run(b, e, "**") for b, e in zip(values, powers, strict=True)])
    np.testing.assert_array_equal(postfix.power_column(values, powers), raised)
