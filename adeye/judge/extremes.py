"""The few samples of a run that decide ``always`` or ``eventually`` of one comparison.

Such a formula is worth what the signal is worth at its extreme, whatever the threshold: robustness
rises with the signal or falls with it. Among samples that come out equal the earliest binds, so
beside the extreme the closest sample before it counts, and the first of all, which binds where a
cap makes everything equal. With these a run is judged again with another threshold, and its trace
is not needed; where the samples cannot tell, it is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.judge.stl.batch import StlColumns, evaluate_columns
from adeye.judge.stl.series import SampleStatus, declared_series
from adeye.judge.stl.syntax import Arithmetic, Comparison, Constant, Signal, Temporal, Term

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.judge.stl.formula import Formula
    from adeye.judge.stl.series import Series
    from adeye.signals import Bools, Floats, Ints, SignalType

FIRST, RIVAL, EXTREME, UNKNOWN, BROKEN = range(5)
"""Samples that are kept: the first, the closest one before the extreme, the extreme, the first that
does not apply, the first that is an error."""

SAMPLES: Final = 5
"""How many they are."""


@dataclass(frozen=True, slots=True)
class Measure:
    """What a formula of one comparison depends on.

    Attributes:
        signal: Name of the signal.
        is_absolute: Whether its magnitude counts.
        is_least: Whether the least sample decides, not the greatest.
    """

    signal: str
    is_absolute: bool
    is_least: bool

    @property
    def text(self) -> str:
        """Write it for people.

        >>> Measure("ego.lane_offset", is_absolute=True, is_least=False).text
        'greatest abs(ego.lane_offset)'
        """
        term = f"abs({self.signal})" if self.is_absolute else self.signal
        return f"{'least' if self.is_least else 'greatest'} {term}"


def measure_of(formula: Formula | None) -> Measure | None:
    """Tell what a formula depends on; None unless it is of one comparison with a constant.

    The formula is ``always`` or ``eventually`` without a window of a signal, or its magnitude, that
    is compared with a number.
    """
    root = None if formula is None else formula.root
    if not (
        isinstance(root, Temporal)
        and root.window is None
        and isinstance(comparison := root.operand, Comparison)
    ):
        return None
    rises = comparison.operator in {">", ">="}
    term, constant = comparison.left, comparison.right
    if isinstance(term, Constant):
        term, constant, rises = comparison.right, comparison.left, not rises
    named = _signal(term)
    if named is None or not isinstance(constant, Constant):
        return None
    return Measure(*named, is_least=rises == (root.operator == "always"))


def _signal(term: Term) -> tuple[str, bool] | None:
    """Name the signal of a term, and whether its magnitude is meant."""
    if isinstance(term, Signal):
        return term.name, False
    if (
        isinstance(term, Arithmetic)
        and term.operator == "abs"
        and isinstance(term.operands[0], Signal)
    ):
        return term.operands[0].name, True
    return None


@dataclass(frozen=True, slots=True)
class Extremes:
    """The samples of R runs that decide, see ``FIRST`` and its neighbours.

    Attributes:
        run: (R,) rows of the trace.
        row: (R, 5) row of each sample, -1 for none.
        value: (R, 5) as the series has it, not its magnitude; NaN for none.
        status: (R, 5) ``SampleStatus``.
        actor: (R, 5) index of the object, -1 for none.
        is_cut: (R,) whether obligations lie beyond the trace.
    """

    run: Ints
    row: Ints
    value: Floats
    status: Ints
    actor: Ints
    is_cut: Bools


def find_extremes(
    measure: Measure,
    series: Series,
    *,
    length: Ints,
    horizon: Ints,
    complete: Bools,
    chosen: Bools,
) -> Extremes:
    """Find the samples of the chosen runs that decide; see ``evaluate_columns`` for the arguments.

    Args:
        measure: What decides.
        series: The signal, samples (B, T).
        length: (B,).
        horizon: (B,).
        complete: (B,).
        chosen: (B,).
    """
    runs = np.flatnonzero(chosen)
    known = np.asarray(length, dtype=np.int64)[runs]
    last = np.minimum(np.asarray(horizon, dtype=np.int64)[runs], known - 1)
    is_cut = ~np.asarray(complete)[runs] & (np.asarray(horizon)[runs] > known - 1)
    values = np.asarray(series.values, dtype=np.float64)[runs]
    status = _statuses(series, values, runs)
    places = np.arange(values.shape[1])
    is_known = places < known[:, np.newaxis]
    is_asked = places <= last[:, np.newaxis]
    is_free = status == SampleStatus.NO_CONFLICT
    is_fit = is_asked & ((status == SampleStatus.VALUE) | is_free)
    size = np.where(is_free, np.inf, np.abs(values) if measure.is_absolute else values)
    # "No conflict" of a magnitude is a magnitude, of a signal +inf; the least decides.
    key = np.where(is_fit, size if measure.is_least else -size, np.inf)
    first = _first(is_fit)
    extreme = np.where(np.isposinf(key.min(axis=1)), first, key.argmin(axis=1))
    before = np.where(places < extreme[:, np.newaxis], key, np.inf)
    closest = np.where(np.isposinf(before.min(axis=1)), first, before.argmin(axis=1))
    rival = np.where((extreme >= 0) & (first < extreme), closest, -1)
    row = np.stack(
        [
            first,
            rival,
            np.where(first >= 0, extreme, -1),
            _first(is_asked & (status == SampleStatus.NOT_APPLICABLE)),
            _first(is_known & (status == SampleStatus.ERROR)),
        ],
        axis=1,
    )
    index = np.arange(len(runs))[:, np.newaxis], np.maximum(row, 0)
    is_there = row >= 0
    actors = np.full(values.shape, -1) if series.actor is None else np.asarray(series.actor)[runs]
    is_value = is_there & (status[index] == SampleStatus.VALUE)
    return Extremes(
        run=runs,
        row=row,
        value=np.where(is_value, values[index], np.nan),
        status=np.where(is_there, status[index], 0),
        actor=np.where(is_there, actors[index], -1),
        is_cut=np.asarray(is_cut),
    )


def _statuses(series: Series, values: Floats, runs: Ints) -> Ints:
    """Give the status of every sample as a formula reads it: what is not finite is no value."""
    found = np.zeros(values.shape, dtype=np.int64)
    is_plain = np.isfinite(values)
    if series.status is None:
        is_free = np.isposinf(values) & (series.cap is not None)
        found = np.where(is_free, int(SampleStatus.NO_CONFLICT), found)
        return np.where(is_plain | is_free, found, int(SampleStatus.ERROR))
    found[:] = np.asarray(series.status)[runs]
    is_right = (
        ((found == SampleStatus.VALUE) & is_plain)
        | ((found == SampleStatus.NO_CONFLICT) & (series.cap is not None))
        | (found == SampleStatus.NOT_APPLICABLE)
    )
    return np.where(is_right, found, int(SampleStatus.ERROR))


def _first(flags: Bools) -> Ints:
    return np.where(flags.any(axis=1), flags.argmax(axis=1), -1)


@dataclass(frozen=True, slots=True)
class FromExtremes:
    """What a formula is worth on R runs, told from few samples.

    Attributes:
        columns: As from the whole trace, with the rows of it.
        is_certain: (R,) whether it is known to be the same as from the whole trace.
    """

    columns: StlColumns
    is_certain: Bools


@dataclass(frozen=True, slots=True)
class _Samples:
    """A source with the one signal that a formula reads."""

    name: str
    samples: Series

    def series(self, name: str) -> Series:
        if name != self.name:
            raise KeyError(name)
        return self.samples


def evaluate_extremes(
    formula: Formula, kept: Extremes, dictionary: Mapping[str, SignalType], step_s: float
) -> FromExtremes:
    """Evaluate a formula of one comparison on the samples that decide it.

    It is the same evaluation as on a trace, of a series that has these samples only.

    Args:
        formula: For which ``measure_of`` gives what was kept.
        kept: Of R runs.
        dictionary: Signals that the runs have.
        step_s: Time between the rows of the trace [s].
    """
    measure = measure_of(formula)
    assert measure is not None
    declared = dictionary[measure.signal]
    runs = len(kept.run)
    # In the order of the trace, once each, what is missing at the end.
    order = np.argsort(np.where(kept.row < 0, np.iinfo(np.int64).max, kept.row), axis=1)
    row = np.take_along_axis(kept.row, order, axis=1)
    is_again = np.zeros(row.shape, dtype=np.bool_)
    is_again[:, 1:] = (row[:, 1:] == row[:, :-1]) & (row[:, 1:] >= 0)
    again = np.argsort(is_again | (row < 0), axis=1, kind="stable")
    order, row = (np.take_along_axis(item, again, axis=1) for item in (order, row))
    length = SAMPLES - (np.take_along_axis(is_again, again, axis=1) | (row < 0)).sum(axis=1)
    samples = declared_series(
        declared,
        np.nan_to_num(np.take_along_axis(kept.value, order, axis=1)),
        np.take_along_axis(kept.status, order, axis=1).astype(np.int8),
        np.take_along_axis(kept.actor, order, axis=1),
    )
    is_enough = length > 0
    found = evaluate_columns(
        formula,
        _Samples(measure.signal, samples),
        step_s=step_s,
        length=np.maximum(length, 1),
        horizon=np.where(kept.is_cut, length, np.maximum(length - 1, 0)),
        complete=~kept.is_cut,
        chosen=is_enough,
    )
    binding = np.take_along_axis(row, np.maximum(found.row, 0)[:, np.newaxis], axis=1)[:, 0]
    binding = np.where(found.row >= 0, binding, -1)
    # The closest sample binds only if it comes out like the extreme. Others may then, too, before
    # it, of which nothing is known.
    is_rival = (binding >= 0) & (binding == kept.row[:, RIVAL])
    is_rival &= kept.row[:, RIVAL] != kept.row[:, FIRST]
    assert len(is_rival) == runs
    return FromExtremes(replace(found, row=binding), is_enough & (~is_rival | found.error))
