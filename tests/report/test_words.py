import math

import pytest

from adeye.judge.verdict import Verdict
from adeye.report.model.part import Binding, Margin
from adeye.report.model.report import Cell
from adeye.report.words import (
    MEANINGS,
    SYMBOLS,
    binding_sentence,
    counted,
    margin_text,
    number,
    quantity,
    unit_text,
    value_text,
    verdict_word,
)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (0.5, "0.50"),
        (0.0456, "0.046"),
        (0.00312, "0.0031"),
        (1.2345, "1.23"),
        (12.345, "12.3"),
        (123.45, "123"),
        (12345.6, "12346"),
        (4e-7, "4.00e-07"),
        (2.5e9, "2.50e+09"),
    ],
)
def test_number_has_about_three_digits(value: float, text: str) -> None:
    assert number(value) == text
    assert number(-value) == ("0" if value == 0.0 else f"\N{MINUS SIGN}{text}")


@pytest.mark.parametrize("exponent", range(-300, 300, 7))
def test_number_that_is_not_zero_never_reads_as_zero(exponent: int) -> None:
    text = number(-1.7 * 10.0**exponent, signed=True)
    assert text.startswith("\N{MINUS SIGN}")
    assert float(text[1:]) == pytest.approx(1.7 * 10.0**exponent, rel=0.06)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_number_that_is_not_finite_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="no place"):
        number(value)


def test_unit_is_written_for_people() -> None:
    assert unit_text("m/s^2") == "m/s²"
    assert unit_text("s^-1") == "s⁻¹"
    assert quantity(2.0, "1") == "2.00"


def test_every_verdict_has_a_sign_of_its_own_and_a_meaning() -> None:
    wanted = {*Verdict, None}
    assert set(SYMBOLS) == set(MEANINGS) == wanted
    assert len(set(SYMBOLS.values())) == len(wanted)


def test_words_of_verdicts() -> None:
    assert verdict_word(Verdict.NOT_RUN) == "NOT RUN"
    assert verdict_word(None) == "not applicable"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (True, "true"),
        (False, "false"),
        ("silent", "silent"),
        (1.5, "1.50 m"),
        (None, "\N{EN DASH}"),
    ],
)
def test_value_is_written_by_its_kind(value: float | str | None, text: str) -> None:
    assert value_text(value, "m") == text


def test_violated_predicate_is_short_by_its_difference() -> None:
    binding = Binding(
        predicate="gap >= 2 m",
        signal="actor.cutter.gap",
        time_s=4.35,
        actor="cutter",
        value=1.2,
        threshold=2.0,
        difference=-0.8,
        unit="m",
    )
    wanted = "gap >= 2 m: actor.cutter.gap is 1.20 m (cutter) at 4.35 s, short by 0.80 m"
    assert binding_sentence(binding) == wanted


def test_predicate_without_a_value_says_why() -> None:
    binding = Binding(predicate="ttc >= 1 s", signal="ttc", note="no conflict", difference=9.0)
    assert binding_sentence(binding) == "ttc >= 1 s: no conflict, to spare: 9.00"


@pytest.mark.parametrize(("value", "text"), [(True, ""), (3.0, "+1.00")])
def test_truth_has_no_margin_to_speak_of(value: float, text: str) -> None:
    cell = Cell(
        fsr="F",
        architecture="a",
        verdict=Verdict.NOT_RUN,
        margin=Margin(value=1.0, unit="1"),
        binding=Binding(predicate="p", signal="s", value=value),
        command="c",
    )
    assert margin_text(cell) == text


def test_counts_are_grouped_by_thousands() -> None:
    assert [counted(things) for things in (0, 999, 1000, 1_000_000)] == [
        "0",
        "999",
        "1,000",
        "1,000,000",
    ]
