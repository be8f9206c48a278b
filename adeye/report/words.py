"""Numbers, verdicts and findings as people read them, speeds and ranges of sensor suites too."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Final

from adeye.judge.verdict import Verdict

if TYPE_CHECKING:
    from adeye.analysis.suite.records import ForwardRange, SpeedRange
    from adeye.report.model.part import Binding
    from adeye.report.model.report import Cell, WorstCase

# --- Numbers, verdicts and findings as people read them -------------------------------------------

MINUS: Final = "\N{MINUS SIGN}"
DASH: Final = "\N{EN DASH}"

SYMBOLS: Final = {
    Verdict.PASS: "\N{CHECK MARK}",
    Verdict.FAIL: "\N{MULTIPLICATION X}",
    Verdict.INCONCLUSIVE: "?",
    Verdict.VACUOUS: "\N{WHITE CIRCLE}",
    Verdict.INVALID: "\N{CIRCLED DIVISION SLASH}",
    Verdict.ERROR: "!",
    Verdict.NOT_RUN: DASH,
    None: "\N{MIDDLE DOT}",
}
"""A sign per verdict, so that none is told by colour alone; None is "not applicable"."""

MEANINGS: Final = {
    Verdict.PASS: "holds in every run that exercised it, with enough of them",
    Verdict.FAIL: "violated in at least one run",
    Verdict.INCONCLUSIVE: "an obligation was open at the end, or the margin is too small to tell",
    Verdict.VACUOUS: "its precondition held in too few runs",
    Verdict.INVALID: "the scenario did not come about as asked",
    Verdict.ERROR: "a metric or the tool itself failed",
    Verdict.NOT_RUN: "a planned run has no result",
    None: "the architecture lacks a signal that it names",
}

_FORBIDDEN: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_POWER: Final = re.compile(r"\^(-?)([0-9])")
_RAISED: Final = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def printable(text: str) -> str:
    r"""Leave out the characters that XML 1.0 cannot hold.

    >>> printable("a\x00b")
    'ab'
    """
    return _FORBIDDEN.sub("", text)


def unit_text(unit: str) -> str:
    """Write a unit for people; ``1`` is none.

    >>> unit_text("m/s^2"), unit_text("1")
    ('m/s²', '')
    """
    if unit == "1":
        return ""
    return _POWER.sub(lambda match: (match[1] + match[2]).translate(_RAISED), unit)


def number(value: float, *, signed: bool = False) -> str:
    """Write a number with three digits or so; one that is not 0 never reads as 0.

    Raises:
        ValueError: It is not finite, and has no place in a report.

    >>> number(12.3456), number(0.5, signed=True), number(0.00053), number(0.000000123)
    ('12.3', '+0.50', '0.00053', '1.23e-07')
    """
    if not math.isfinite(value):
        msg = f"{value} has no place in a report"
        raise ValueError(msg)
    size = abs(value)
    if size == 0.0:
        return "0"
    if size < 1e-6 or size >= 1e6:
        digits = f"{size:.2e}"
    else:
        exponent = math.floor(math.log10(size))
        digits = f"{size:.{max(0, 2 - max(exponent, 0)) if exponent >= -1 else 1 - exponent}f}"
    sign = MINUS if value < 0.0 else "+" if signed else ""
    return sign + digits


def told_apart(value: float, other: float, unit: str) -> str:
    """Write a number with its unit, and with as many digits as tell it from another one.

    >>> told_apart(1.49947, 1.5, "s"), told_apart(1.2, 2.0, "m"), told_apart(2.0, 2.0, "m")
    ('1.499 s', '1.20 m', '2.00 m')
    """
    if value == other or number(value) != number(other):
        return quantity(value, unit)
    written = ((f"{value:.{digits}g}", f"{other:.{digits}g}") for digits in range(4, 18))
    text = next(mine for mine, its in written if mine != its)
    return f"{text.replace('-', MINUS, 1)} {unit_text(unit)}".rstrip()


def counted(things: int) -> str:
    """Write a count so that a large one can be read.

    >>> counted(228), counted(1_000_000)
    ('228', '1,000,000')
    """
    return f"{things:,}"


def quantity(value: float, unit: str, *, signed: bool = False) -> str:
    """Write a number with its unit.

    >>> quantity(1.35, "m/s^2", signed=True)
    '+1.35 m/s²'
    """
    return f"{number(value, signed=signed)} {unit_text(unit)}".rstrip()


def margin_text(judged: Cell | WorstCase) -> str:
    """Write a margin; a predicate that is true or false has none to speak of."""
    margin, binding = judged.margin, judged.binding
    is_number = binding is None or not isinstance(binding.value, bool | str)
    return quantity(margin.value, margin.unit, signed=True) if margin and is_number else ""


def verdict_word(verdict: Verdict | None) -> str:
    """Name a verdict; None is an FSR that does not apply to the architecture."""
    return "not applicable" if verdict is None else verdict.value.replace("_", " ")


def value_text(value: float | str | None, unit: str = "") -> str:
    """Write one side of a predicate."""
    if value is None:
        return DASH
    if isinstance(value, bool):
        return "true" if value else "false"
    return value if isinstance(value, str) else quantity(value, unit)


def binding_sentence(binding: Binding) -> str:
    """Say in one line where a margin comes from.

    >>> from adeye.report.model.part import Binding
    >>> binding_sentence(Binding(predicate="gap >= 2 m", signal="gap", time_s=4.35, value=1.2,
    ...     threshold=2.0, difference=-0.8, unit="m"))
    'gap >= 2 m: gap is 1.20 m at 4.35 s, short by 0.80 m'
    """
    text = f"{binding.predicate}: "
    # What is true or false has no distance to what was asked for, and its note says which it is.
    is_told = binding.value is None or bool(binding.difference is None and binding.note)
    if is_told:
        text += binding.note or "no value"
    else:
        text += f"{binding.signal} is {_side_text(binding.value, binding.threshold, binding.unit)}"
    if binding.actor is not None:
        text += f" ({binding.actor})"
    if binding.time_s is not None:
        text += f" at {binding.time_s:.2f} s"
    if binding.difference is not None:
        word = "short by" if binding.difference < 0.0 else "to spare:"
        text += f", {word} {quantity(abs(binding.difference), binding.unit)}"
    if binding.note and not is_told:
        text += f" ({binding.note})"
    return text


def _side_text(value: float | str | None, limit: float | str | None, unit: str) -> str:
    """Write the value of a predicate so that it is told from what it is compared with."""
    if isinstance(value, bool | str) or isinstance(limit, bool | str) or None in (value, limit):
        return value_text(value, unit)
    assert value is not None
    assert limit is not None
    return told_apart(value, limit, unit)


# --- Speeds, shares and ranges of a suite as people read them; rounding never flatters ------------

KMH: Final = 3.6
_SLOWEST_SAID: Final = 10.5
"""Speeds [km/h] from which the lowest one is worth a word; the search begins at 10."""


def kmh(speed: float) -> str:
    """Write a speed in whole km/h, rounded down: what is promised must hold.

    >>> kmh(27.7)
    '99'
    """
    return f"{math.floor(speed * KMH + 1e-6)}"


def percent(share: float) -> str:
    """Write a share in whole percent; only all is 100, and only nothing is 0.

    >>> percent(0.9999), percent(1.0), percent(0.001), percent(0.0)
    ('99', '100', '1', '0')
    """
    if 0.0 < share < 0.01:
        return "1"
    return f"{math.floor(100.0 * share + 1e-9)}"


def metres(value: float | None) -> str:
    """Write range to spare in whole metres, rounded down.

    >>> metres(12.7), metres(-0.2) == f"{MINUS}1", metres(None) == DASH
    ('+12', True, True)
    """
    if value is None:
        return DASH
    whole = math.floor(value + 1e-6)
    return f"{MINUS}{-whole}" if whole < 0 else f"+{whole}"


def left_speed(speed: float | None) -> str:
    """Write a speed that is left, ``none`` for none."""
    return "none" if speed is None else kmh(speed)


def speed_text(found: SpeedRange, odd_speed: float | None) -> str:
    """Write the highest speed with the sensor that it rests on; ``!`` is below the ODD's.

    Args:
        found: Speeds that a suite supports.
        odd_speed: Highest of the ODD, if there is one [m/s].
    """
    if found.highest_mps is None or found.lowest_mps is None:
        return "none" if odd_speed is None else "none !"
    text = f"> {kmh(found.highest_mps)}" if found.is_limit else kmh(found.highest_mps)
    if odd_speed is not None and found.highest_mps < odd_speed:
        text += " !"
    if found.lowest_mps * KMH > _SLOWEST_SAID:
        text += f" (from {math.ceil(found.lowest_mps * KMH - 1e-6)})"
    return f"{text} {found.sensor}"


def forward_text(found: ForwardRange) -> str:
    """Write the speed that UN R157 allows for a forward range; ``!`` is below the ODD's."""
    if not found.sensor:
        return "none" if found.needed_m is None else "none !"
    limit = "< 60" if found.speed_mps is None else kmh(found.speed_mps)
    is_short = found.needed_m is not None and found.range_m < found.needed_m
    return f"{limit}{' !' if is_short else ''} by {math.floor(found.range_m)} m"
