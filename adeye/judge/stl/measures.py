"""Compiled: terms and predicates of a numbered formula at the rows of one run.

"No conflict" (+inf) passes through arithmetic; where it makes a comparison infinite, the declared
cap is the margin. Everything that is neither finite nor declared is an error: NaN, an infinity
without a cap, a truth value that is not 0 or 1, a code without a label, a status out of range.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from adeye.judge.stl import program
from adeye.judge.stl.series import SampleStatus
from adeye.kernel.jit import compiled, inlined

if TYPE_CHECKING:
    from adeye.judge.stl.program import State, Tables
    from adeye.signals import Bytes, Floats, Ints


IS_UNKNOWN: Final = 1
IS_ERROR: Final = 2
"""Flags of a term at a row."""

OPEN, EXACT, SIGN = range(3)
"""What is known of a condition at every row before the last: nothing; that its bounds are equal;
that they are 1 or -1, too, as its truth is. At the last row many signals say nothing."""

NO_STATUS: Final = -1
"""Status of every sample of a series that declares none."""

_NO_CONFLICT: Final = int(SampleStatus.NO_CONFLICT)
_NOT_APPLICABLE: Final = int(SampleStatus.NOT_APPLICABLE)
_VALUE: Final = int(SampleStatus.VALUE)


@inlined
def kind_and_parts(node: Ints) -> tuple[int, int, int]:
    """Return the kind of a condition and the numbers of its parts."""
    return node[program.KIND], node[program.FIRST_PART], node[program.SECOND_PART]


@compiled
def fill_term(  # noqa: C901, PLR0912 - one branch for each operation
    term: int, tables: Tables, samples: Floats, statuses: Bytes, known: int, state: State
) -> None:
    """Calculate a term at the known rows of a run; samples and statuses are (S, T)."""
    values, flags = state.values, state.flags
    operation, first, second = tables.terms[term, 0], tables.terms[term, 1], tables.terms[term, 2]
    out, marks = values[term], flags[term]
    if operation == program.SIGNAL:
        _read_signal(samples[first], statuses[first], tables.signals[first], known, out, marks)
        return
    if operation == program.CONSTANT:
        for k in range(known):
            out[k] = tables.constants[term]
            marks[k] = 0
        return
    left, right = values[first], values[second]
    if operation == program.NEGATE:
        for k in range(known):
            out[k] = -left[k]
            marks[k] = flags[first, k]
        return
    for k in range(known):
        one, other = left[k], right[k]
        if operation == program.ADD:
            found = one + other
        elif operation == program.SUBTRACT:
            found = one - other
        elif operation == program.LEAST:
            found = min(one, other)
        elif operation == program.GREATEST:
            found = max(one, other)
        elif operation == program.MULTIPLY:
            found = one * other
        elif operation == program.DIVIDE:
            found = math.nan if other == 0.0 else one / other
        else:
            out[k] = abs(one)
            marks[k] = flags[first, k]
            continue
        mark = flags[first, k] | flags[second, k]
        out[k], marks[k] = checked_term(found, one, other, mark)


@compiled
def checked_term(found: float, one: float, other: float, mark: int) -> tuple[float, int]:
    """Make an error of what is no number, or infinite without an infinite operand."""
    if mark == 0 and math.isfinite(found):
        return found, 0
    was_infinite = math.isinf(one) or math.isinf(other)
    is_error = math.isnan(found) or (math.isinf(found) and not was_infinite)
    if is_error and not mark & IS_UNKNOWN:
        mark |= IS_ERROR
    return (0.0 if mark else found), mark


@compiled
def parted(difference: float, slack: float) -> float:
    """Give a difference of two numbers, 0 up to the slack that they are compared with."""
    return 0.0 if abs(difference) <= slack else difference


@compiled
def _are_plain(samples: Floats, statuses: Bytes, kind: int, labels: int, known: int) -> bool:
    """Tell whether all samples are values that fit their kind: loops without branches."""
    odd = 0
    for k in range(known):
        odd |= statuses[k] != _VALUE
    if kind == program.NUMBER:
        for k in range(known):
            odd |= not samples[k] - samples[k] == 0.0  # noqa: SIM201 - NaN is neither
    elif kind == program.BOOLEAN:
        for k in range(known):
            odd |= (samples[k] != 0.0) & (samples[k] != 1.0)
    else:
        for k in range(known):
            value = samples[k]
            odd |= not (value >= 0.0) & (value < labels) & (value == math.floor(value))
    return odd == 0


@compiled
def _are_plain_or_free(samples: Floats, statuses: Bytes, known: int) -> bool:
    """Tell whether all samples are finite values or "no conflict"."""
    odd = 0
    for k in range(known):
        is_free = statuses[k] == _NO_CONFLICT
        is_value = (statuses[k] == _VALUE) & (samples[k] - samples[k] == 0.0)
        odd |= not is_free | is_value
    return odd == 0


@compiled
def _read_signal(  # noqa: C901 - one branch for each status
    samples: Floats, statuses: Bytes, signal: Ints, known: int, out: Floats, marks: Bytes
) -> None:
    """Sort the samples of a signal into values, "no conflict", unknown and errors."""
    has_cap, kind, labels = signal[0] != 0, signal[1], signal[2]
    # Of the last row nothing is decided, so that many signals do not apply there.
    begin = 0
    if _are_plain(samples, statuses, kind, labels, known - 1):
        begin = known - 1
        for k in range(begin):
            out[k] = samples[k]
            marks[k] = 0
    elif has_cap and kind == program.NUMBER and _are_plain_or_free(samples, statuses, known - 1):
        begin = known - 1
        for k in range(begin):
            out[k] = math.inf if statuses[k] == _NO_CONFLICT else samples[k]
            marks[k] = 0
    for k in range(begin, known):
        value, status = samples[k], statuses[k]
        mark = 0
        is_free = status == _NO_CONFLICT
        if status == NO_STATUS:
            is_free = has_cap and value == math.inf
            mark = 0 if is_free or math.isfinite(value) else IS_ERROR
        elif status == _NOT_APPLICABLE:
            mark = IS_UNKNOWN
        elif not is_free and not (status == _VALUE and math.isfinite(value)):
            mark = IS_ERROR
        if is_free and (not has_cap or kind != program.NUMBER):
            mark = IS_ERROR
        if mark != IS_UNKNOWN and (
            (kind == program.BOOLEAN and value not in (0.0, 1.0))
            or (
                kind == program.ENUMERATION
                and not (0.0 <= value < labels and value == math.floor(value))
            )
        ):
            mark = IS_ERROR
        marks[k] = mark
        out[k] = 0.0 if mark else (math.inf if is_free else value)


@compiled
def fill_predicate(node: int, tables: Tables, known: int, state: State) -> bool:
    """Measure a predicate at the known rows; tell whether one of them is an error."""
    if tables.nodes[node, program.KIND] == program.WORD:
        begin, marks = _fill_words(node, tables, known, state)
        state.exact[node] = SIGN if begin == known - 1 else OPEN
    else:
        begin, marks = _fill_differences(node, tables, known, state)
        state.exact[node] = EXACT if begin == known - 1 else OPEN
    return bool(marks & IS_ERROR)


@compiled
def _fill_words(node: int, tables: Tables, known: int, state: State) -> tuple[int, int]:
    """Measure a predicate about words or truth values.

    Returns:
        Rows from the first on that are known, the last left out, and the flags of all rows.
    """
    what, code, flags = tables.nodes[node], tables.limits[node, program.CODE], state.flags
    (_, first, second), flag = kind_and_parts(what), what[program.FLAG] != 0
    left, right = state.values[first], state.values[second]
    bounds, truth = state.bounds[node], state.truth[node]
    marks = 0
    for k in range(known - 1):
        marks |= flags[first, k] | flags[second, k]
    # A loop without branches; of the last row many signals say nothing.
    begin = known - 1 if marks == 0 else 0
    for k in range(begin):
        holds = (left[k] == (code if code >= 0.0 else right[k])) != flag
        bounds[0, k] = bounds[1, k] = 1.0 if holds else -1.0
        truth[0, k] = truth[1, k] = 1 if holds else -1
    for k in range(begin, known):
        mark = flags[first, k] | flags[second, k]
        marks |= mark
        holds = (left[k] == (code if code >= 0.0 else right[k])) != flag
        sign = 1 if holds else -1
        _write(k, float(sign), sign, mark, bounds, truth)
    return begin, marks


@compiled
def _fill_differences(node: int, tables: Tables, known: int, state: State) -> tuple[int, int]:
    """Measure a comparison or equality of numbers.

    Returns:
        Rows from the first on that are known, the last left out, and the flags of all rows.
    """
    what, limits, flags = tables.nodes[node], tables.limits[node], state.flags
    (kind, first, second), flag = kind_and_parts(what), what[program.FLAG] != 0
    left, right = state.values[first], state.values[second]
    bounds, truth = state.bounds[node], state.truth[node]
    is_comparison = kind == program.COMPARE
    lowest, highest, scale = (
        limits[program.LOWER_CAP],
        limits[program.UPPER_CAP],
        limits[program.SCALE],
    )
    slack = limits[program.SLACK]
    marks = 0
    begin = 0
    if is_comparison and _are_comparable(
        left, right, flags[first], flags[second], limits, known - 1
    ):
        begin = known - 1
    for k in range(begin):
        one, other = left[k], right[k]
        difference = parted(one - other, slack)
        robustness = min(max(difference, lowest), highest) / scale
        bounds[0, k] = bounds[1, k] = robustness
        holds = (difference > 0.0) | ((difference == 0.0) & (not flag))
        truth[0, k] = truth[1, k] = 1 if holds else -1
    for k in range(begin, known):
        one, other = left[k], right[k]
        mark = flags[first, k] | flags[second, k]
        difference, mark = checked_term(parted(one - other, slack), one, other, mark)
        if is_comparison:
            holds = difference > 0.0 or (difference == 0.0 and not flag)
            margin = min(max(difference, lowest), highest)
            is_finite = math.isfinite(margin)
        else:
            distance = abs(difference)
            margin = distance if flag else -distance
            holds = (distance == 0.0) != flag
            is_finite = math.isfinite(difference)
        if not is_finite:
            mark |= IS_ERROR
        marks |= mark
        _write(k, margin / scale, 1 if holds else -1, mark, bounds, truth)
    return begin, marks


@compiled
def _are_comparable(
    left: Floats, right: Floats, left_marks: Bytes, right_marks: Bytes, limits: Floats, known: int
) -> bool:
    """Tell whether every difference is a number, or "no conflict" with a cap."""
    odd = 0
    lowest, highest = limits[program.LOWER_CAP], limits[program.UPPER_CAP]
    for k in range(known):
        odd |= left_marks[k] | right_marks[k]
    for k in range(known):
        one, other = left[k], right[k]
        difference = one - other
        is_finite = difference - difference == 0.0
        was_infinite = (one - one != 0.0) | (other - other != 0.0)
        is_capped = ((difference > highest) & (highest < math.inf)) | (
            (difference < lowest) & (lowest > -math.inf)
        )
        odd |= not is_finite | (was_infinite & is_capped)
    return odd == 0


@compiled
def _write(k: int, robustness: float, sign: int, mark: int, bounds: Floats, truth: Bytes) -> None:
    """Write the state at a row, as wide as can be where it is unknown or an error."""
    if mark == 0:
        bounds[0, k] = bounds[1, k] = robustness
        truth[0, k] = truth[1, k] = sign
    else:
        bounds[0, k], bounds[1, k] = -math.inf, math.inf
        truth[0, k], truth[1, k] = -1, 1
