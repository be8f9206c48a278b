"""Numbers, verdicts and findings as people read them."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Final

from adeye.evaluation.verdict import Verdict

if TYPE_CHECKING:
    from adeye.report.model import Cell, WorstCase
    from adeye.report.parts import Binding

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

    >>> number(12.3456), number(0.5, signed=True), number(0.0000123)
    ('12.3', '+0.50', '1.23e-05')
    """
    if not math.isfinite(value):
        msg = f"{value} has no place in a report"
        raise ValueError(msg)
    size = abs(value)
    if size == 0.0:
        return "0"
    if size < 0.001 or size >= 1e6:
        digits = f"{size:.2e}"
    else:
        exponent = math.floor(math.log10(size))
        digits = f"{size:.{max(0, 2 - max(exponent, 0)) if exponent >= -1 else 1 - exponent}f}"
    sign = MINUS if value < 0.0 else "+" if signed else ""
    return sign + digits


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

    >>> from adeye.report.parts import Binding
    >>> binding_sentence(Binding(predicate="gap >= 2 m", signal="gap", time_s=4.35, value=1.2,
    ...     threshold=2.0, difference=-0.8, unit="m"))
    'gap >= 2 m: gap is 1.20 m at 4.35 s, short by 0.80 m'
    """
    text = f"{binding.predicate}: "
    if binding.value is None:
        text += binding.note or "no value"
    else:
        text += f"{binding.signal} is {value_text(binding.value, binding.unit)}"
    if binding.actor is not None:
        text += f" ({binding.actor})"
    if binding.time_s is not None:
        text += f" at {binding.time_s:.2f} s"
    if binding.difference is not None:
        word = "short by" if binding.difference < 0.0 else "to spare:"
        text += f", {word} {quantity(abs(binding.difference), binding.unit)}"
    if binding.value is not None and binding.note:
        text += f" ({binding.note})"
    return text
