"""Numbers and names for people."""

import csv
import io
import math

import pytest

from adeye.analysis.suite.records import ForwardRange, SpeedRange
from adeye.judge.verdict import Verdict
from adeye.report import words
from adeye.report.cells import clean, csv_cell
from adeye.report.model.part import Binding, Margin
from adeye.report.model.report import Cell
from tests.frozen import assert_frozen
from tests.refusals import refused


def test_number_has_about_three_digits() -> None:
    for value, text in (
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
    ):
        assert words.number(value) == text
        assert words.number(-value) == ("0" if value == 0.0 else f"\N{MINUS SIGN}{text}")
    for value in (math.nan, math.inf):
        refused(ValueError, words.number, value, says="no place")


def test_number_that_is_not_zero_never_reads_as_zero() -> None:
    for exponent in range(-300, 300, 7):
        text = words.number(-1.7 * 10.0**exponent, signed=True)
        assert text.startswith("\N{MINUS SIGN}")
        assert float(text[1:]) == pytest.approx(1.7 * 10.0**exponent, rel=0.06)


def test_unit_is_written_for_people() -> None:
    assert words.unit_text("m/s^2") == "m/s²"
    assert words.unit_text("s^-1") == "s⁻¹"
    assert words.quantity(2.0, "1") == "2.00"


def test_every_verdict_has_a_sign_of_its_own_and_a_meaning() -> None:
    wanted = {*Verdict, None}
    assert set(words.SYMBOLS) == set(words.MEANINGS) == wanted
    assert len(set(words.SYMBOLS.values())) == len(wanted)
    assert words.verdict_word(Verdict.NOT_RUN) == "NOT RUN"
    assert words.verdict_word(None) == "not applicable"


def test_value_is_written_by_its_kind() -> None:
    values: dict[float | str | None, str] = {True: "true", False: "false", 1.5: "1.50 m"}
    values |= {"silent": "silent", None: "\N{EN DASH}"}
    assert {value: words.value_text(value, "m") for value in values} == values


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
    assert words.binding_sentence(binding) == wanted


def test_predicate_without_a_value_says_why() -> None:
    binding = Binding(predicate="ttc >= 1 s", signal="ttc", note="no conflict", difference=9.0)
    assert words.binding_sentence(binding) == "ttc >= 1 s: no conflict, to spare: 9.00"


def test_binding_of_what_is_true_or_false_is_told_in_words() -> None:
    binding = Binding(predicate="contact", signal="contact", time_s=5.15, actor="cutter",
                      value=1.0, threshold=1.0, note="contact is true")  # fmt: skip
    wanted = "contact: contact is true (cutter) at 5.15 s"
    assert words.binding_sentence(binding) == wanted


def test_value_is_told_with_as_many_digits_as_tell_it_from_its_limit() -> None:
    for value, limit, text in (
        (1.49947, 1.5, "1.499 s"),
        (1.4999992, 1.5, "1.499999 s"),
        (-0.5, -0.5000004, "\N{MINUS SIGN}0.5 s"),
        (1.2, 1.5, "1.20 s"),
        (1.5, 1.5, "1.50 s"),
    ):
        assert words.told_apart(value, limit, "s") == text


def test_truth_has_no_margin_to_speak_of() -> None:
    for value, text in ((True, ""), (3.0, "+1.00")):
        cell = Cell(
            fsr="F",
            architecture="a",
            verdict=Verdict.NOT_RUN,
            margin=Margin(value=1.0, unit="1"),
            binding=Binding(predicate="p", signal="s", value=value),
            command="c",
        )
        assert words.margin_text(cell) == text


def test_counts_are_grouped_by_thousands() -> None:
    texts = {0: "0", 999: "999", 1000: "1,000", 1_000_000: "1,000,000"}
    assert {things: words.counted(things) for things in texts} == texts


FORMULAS = [
    "=1+1", "+1+1", "-1+1", "@SUM(A1)", "=cmd|' /C calc'!A0", "  =1+1", "\t=1+1", "\r=1+1",
    "\n=1+1", "\x00=1+1", "\x1b=1+1", "\uff1d1+1", "\uff0b1+1", "\uff0d1+1", "\uff20SUM(A1)",
    "=", "-x", "+4912", "-2+3",
]  # fmt: skip
HARMLESS = ["", "a=b", "cut_in", "-1.5", "+0.10", "-1e-3", " -2 ", "-", "+", "'quoted"]


def test_formula_is_text_for_a_spreadsheet_and_what_is_none_stays_as_it_is() -> None:
    for text in FORMULAS:
        cell = csv_cell(text)
        assert cell.startswith("'") is (text not in {"=", "+4912"}), text
        assert cell.removeprefix("'") == clean(text), text
    for value in (*HARMLESS, 1, -1, -0.5, None):
        assert csv_cell(value) == value


def test_everything_else_is_plain_text() -> None:
    cells = {
        True: "true",
        False: "false",
        b"\x1b]0;x": "1b5d303b78",
        "a\x1b[31mb": "a[31mb",
        "a\nb": "a b",
        "x\u202ey": "xy",
    }
    assert {value: csv_cell(value) for value in cells} == cells


def test_cells_survive_a_reader() -> None:
    values = ["'=1", 'a"b', "a,b", "x"]
    text = io.StringIO()
    csv.writer(text).writerow(map(csv_cell, values))
    assert next(csv.reader(io.StringIO(text.getvalue()))) == values


def test_only_all_is_all_and_only_nothing_is_nothing() -> None:
    texts = {0.0: "0", 1e-6: "1", 0.5: "50", 0.999: "99", 1.0: "100"}
    assert {share: words.percent(share) for share in texts} == texts


def test_speeds_and_ranges_are_rounded_down() -> None:
    assert words.kmh(99.99 / 3.6) == "99"
    assert words.kmh(100.0 / 3.6) == "100"
    assert words.metres(0.9) == "+0"
    assert words.metres(-0.1) == "\N{MINUS SIGN}1"
    assert words.left_speed(None) == "none"


def speed(lowest: float | None, highest: float | None, *, is_limit: bool = False) -> SpeedRange:
    sensor = "" if highest is None else "eye"
    low, high = (None if each is None else each / 3.6 for each in (lowest, highest))
    return SpeedRange("dry", "stopped_car", low, high, is_limit, sensor, 8.0)


def test_speed_names_its_sensor_and_is_marked_below_that_of_the_odd() -> None:
    assert words.speed_text(speed(10.0, 80.0), None) == "80 eye"
    assert words.speed_text(speed(10.0, 80.0), 100.0 / 3.6) == "80 ! eye"
    assert words.speed_text(speed(10.0, 120.0), 100.0 / 3.6) == "120 eye"
    assert words.speed_text(speed(21.2, 80.0), None) == "80 (from 22) eye"
    assert words.speed_text(speed(10.0, 250.0, is_limit=True), None) == "> 250 eye"
    assert words.speed_text(speed(None, None), None) == "none"
    assert words.speed_text(speed(None, None), 30.0) == "none !"


def test_forward_range_is_told_as_the_speed_that_it_allows() -> None:
    assert words.forward_text(ForwardRange("dry", 95.9, "eye", 102.9 / 3.6, None)) == "102 by 95 m"
    assert (
        words.forward_text(ForwardRange("dry", 95.9, "eye", 102.9 / 3.6, 150.0)) == "102 ! by 95 m"
    )
    assert words.forward_text(ForwardRange("dry", 30.0, "eye", None, None)) == "< 60 by 30 m"
    assert words.forward_text(ForwardRange("dry", 0.0, "", None, 150.0)) == "none !"


NUMBERS = (
    0.0, -0.0, 1.0, -1.0, 0.5, 0.05, 0.005, 0.0049, 0.00051, 1e-5, 1e-12, 9.994, 9.995, 9.996, 10.0,
    99.94, 99.95, 99.96, 100.0, 123.456, 999.4, 999.5, 1000.0, 1234.5, 99999.0, 1e5, 1.5e6, 1e9,
    1e15, 1e22, -0.004, -9.999, -123.4, -5e6,
)  # fmt: skip
UNITS = ("m", "s", "m/s", "m/s^2", "rad", "1", "", "m^2", "1/s")


def test_numbers_as_people_read_them_are_frozen() -> None:
    """At each change of digits, signed and not, with units, shares, speeds and distances."""
    lines = []
    for value in NUMBERS:
        told = (
            words.number(value),
            words.number(value, signed=True),
            words.quantity(value, "m"),
            words.quantity(value, "m/s", signed=True),
            words.quantity(value, "1"),
            words.value_text(value, "s"),
        )
        lines.append(f"{value!r}: {' | '.join(told)}")
    for value in (0.0, 0.1, 0.999, 1.0, 5.0, 13.888889, 27.77777, 36.11111, 100.0):
        far = words.kmh(value), words.metres(value), words.metres(10.0 * value)
        lines.append(f"speed {value!r}: {' | '.join(far)} | {words.left_speed(value)}")
    lines += [
        f"share {share!r}: {words.percent(share)}"
        for share in (0.0, 1e-7, 0.0004, 0.0005, 0.001, 0.0123, 0.5, 0.99949, 0.9995, 0.99999, 1.0)
    ]
    lines.append(
        f"none: {words.metres(None)} | {words.left_speed(None)} | {words.value_text(None)}"
    )
    lines += [f"{count} things: {words.counted(count)}" for count in (0, 1, 2, 999, 1000, 1234567)]
    lines += [
        f"{one!r} from {other!r}: {words.told_apart(one, other, 'm')}"
        for one, other in ((1.0, 1.0), (1.0, 1.0001), (0.123456789, 0.123456788), (1e6, 1e6 + 1.0))
    ]
    lines += [f"{unit!r}: {words.unit_text(unit)} | {words.quantity(2.5, unit)}" for unit in UNITS]
    for text in ("plain", "two\nlines", "\x1b[31mred", "\u202eback", "tab\tand\0nul", "é\u0301"):
        lines.append(f"{text!r}: {words.printable(text)!r}")
    lines += [f"{word!r}: {words.verdict_word(word)}" for word in (None, *Verdict)]
    for thing in ("late", True, False, 3, None):
        lines.append(f"{thing!r}: {words.value_text(thing)} | {words.value_text(thing, 'm')}")
    assert_frozen("numbers.txt", "\n".join([*lines, ""]))
