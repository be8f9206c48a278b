"""Dimensions of expressions: what fits together, what does not."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.errors import ExpressionError
from adeye.spec.expression import measured
from adeye.spec.grammar import read_steps
from adeye.units import Dimension

DIMS = {
    "speed": Dimension.SPEED,
    "gap": Dimension.LENGTH,
    "time": Dimension.TIME,
    "braking": Dimension.ACCELERATION,
    "heading": Dimension.ANGLE,
    "yaw_rate": Dimension.ANGULAR_RATE,
    "bend": Dimension.CURVATURE,
    "rain": Dimension.RAIN_RATE,
    "ratio": Dimension.NONE,
    "open": None,
}


def dimension(text: str) -> Dimension | None:
    return measured(read_steps(text), DIMS, text)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("gap", Dimension.LENGTH),
        ("rain", Dimension.RAIN_RATE),
        ("-gap + 5 m", Dimension.LENGTH),
        ("gap / speed", Dimension.TIME),
        ("speed * time", Dimension.LENGTH),
        ("speed ** 2 / (2 * braking)", Dimension.LENGTH),
        ("speed ** 2 * bend", Dimension.ACCELERATION),
        ("sqrt(gap * gap)", Dimension.LENGTH),
        ("sqrt(2 * braking * gap)", Dimension.SPEED),
        ("(gap * gap) ** 0.5", Dimension.LENGTH),
        ("gap ** -1", Dimension.CURVATURE),
        ("1 / time", Dimension.FREQUENCY),
        ("yaw_rate * time", Dimension.ANGLE),
        ("sin(heading)", Dimension.NONE),
        ("sin(ratio)", Dimension.NONE),
        ("sin(90 deg) * gap", Dimension.LENGTH),
        ("exp(ratio)", Dimension.NONE),
        ("2 ** ratio", Dimension.NONE),
        ("abs(gap)", Dimension.LENGTH),
        ("min(gap, 5 m, 0)", Dimension.LENGTH),
        ("clip(speed, 0, 130 km/h)", Dimension.SPEED),
        ("if_(gap > 5 m, speed, 0)", Dimension.SPEED),
        ("gap > 5 m", Dimension.NONE),
        ("gap > 0", Dimension.NONE),
        ("gap in [5 m, 10 m]", Dimension.NONE),
        ("not ratio and gap < 1 m", Dimension.NONE),
        ("speed > rain", Dimension.NONE),
        ("0", None),
        ("0 * gap", None),
        ("open", None),
        ("unheard_of", None),
        ("open + gap", Dimension.LENGTH),
        ("open * gap", None),
        ("open * 2", None),
        ("open / 2", None),
        ("gap / open", None),
        ("open ** 2", None),
        ("open == 'wet'", Dimension.NONE),
        ("'wet'", None),
    ],
)
def test_dimension(text: str, found: Dimension | None) -> None:
    assert dimension(text) is found


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("speed + gap", "puts a speed and a length together"),
        ("gap - 5", "puts a length and a plain number together"),
        ("gap > 2 s", "puts a length and a time together"),
        ("gap == 5", "puts a length and a plain number together"),
        ("gap + 0 s", "puts a length and a time together"),
        ("gap in [5 m, 2 s]", "puts a length and a time together"),
        ("gap > 5 m and (time < 2 m or ratio)", "puts a time and a length together"),
        ("min(gap, speed)", "puts a length and a speed together"),
        ("clip(gap, 0, 2 s)", "puts a length and a time together"),
        ("if_(ratio, gap, speed)", "puts a length and a speed together"),
        ("heading + ratio", "puts an angle and a plain number together"),
        ("if_(gap, 1, 2)", "a length is taken for true or false"),
        ("gap and ratio", "a length is taken for true or false"),
        ("not speed", "a speed is taken for true or false"),
        ("sin(gap)", "a length has no sin"),
        ("exp(speed)", "a speed has no exp"),
        ("log(2 s)", "a time has no log"),
        ("ratio ** gap", "a length is an exponent"),
        ("2 ** (3 s)", "a time is an exponent"),
        ("gap ** ratio", "to a power that is no small number"),
        ("gap ** 1e300", "to a power that is no small number"),
        ("sqrt(gap)", "takes a root of a length"),
        ("gap ** 0.3", "takes a root of a length"),
        ("gap * gap * gap", "measures length^3 time^0 angle^0"),
    ],
)
def test_mismatch_is_named(text: str, message: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        dimension(text)
    assert message in caught.value.message


def test_long_chain_needs_no_recursion() -> None:
    assert dimension("+".join(["gap"] * 400)) is Dimension.LENGTH


@given(
    left=st.sampled_from(sorted(DIMS.keys() - {"open"})),
    right=st.sampled_from(sorted(DIMS.keys() - {"open"})),
)
def test_sum_is_defined_exactly_for_equal_exponents(left: str, right: str) -> None:
    one, other = DIMS[left], DIMS[right]
    assert one is not None
    assert other is not None
    if one.exponents == other.exponents:
        assert dimension(f"{left} + {right}") is not None
    else:
        with pytest.raises(ExpressionError, match="together"):
            dimension(f"{left} + {right}")


@given(left=st.sampled_from(sorted(DIMS)), right=st.sampled_from(sorted(DIMS)))
def test_order_of_comparison_does_not_matter(left: str, right: str) -> None:
    def answer(text: str) -> object:
        try:
            return dimension(text)
        except ExpressionError:
            return "refused"

    assert answer(f"{left} < {right}") == answer(f"{right} > {left}")
