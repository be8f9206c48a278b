"""Search for runs that fail a formula and its parts: what no run fails demands nothing.

Runs are made up and judged like any others. A run is a few stretches of time in which no signal
changes, as long as the formula's windows, or a row more or less. Numbers are those of the formula,
what is computed of two of them or of another signal, a little beside them, or of any size. In some
runs signals are pulled to where the formula fails, others are the nearest to failing of those
before, altered. Time is the real one, for as long as a scenario lasts.

A run that is found is a proof: it fails without rounding, too, and by more than that of what is
written. One that is not found is none: who knows of one says so in the FSR.
There is no other way to tell what holds by its form alone: a proof of that would need a second
meaning of formulas, and would find less.

Source:
    Annpureddy, Liu, Fainekos and Sankaranarayanan (2011), "S-TaLiRo: A tool for temporal logic
    falsification for hybrid systems": robustness says how near a run is to failing.
"""

from __future__ import annotations

import math
import operator
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from itertools import chain, pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye.judge.stl import syntax
from adeye.judge.stl.batch import VIOLATED, evaluate_columns
from adeye.judge.stl.formula import TRUTH_LABELS, unit_exponents
from adeye.judge.stl.series import SampleStatus, declared_series
from adeye.kernel.relation import tick_times
from adeye.units import Dimension

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

    from adeye.judge.stl.batch import StlColumns
    from adeye.judge.stl.formula import Formula
    from adeye.judge.stl.series import Series
    from adeye.signals import Floats, Ints, SignalType

# --- Parts of a formula that come out alike on every run: they ask for nothing --------------------


class Runs(NamedTuple):
    """What the runs of a scenario are like.

    Attributes:
        declared: Their signals; those of the formula, at least.
        step_s: Time between rows [s].
        horizon_s: Time within which an obligation may start [s].
        tail_s: Time after it [s].
    """

    declared: Mapping[str, SignalType]
    step_s: float
    horizon_s: float
    tail_s: float


NO_OBJECT: Final = "there is no object"


def missing_from(
    declared: Mapping[str, SignalType], *, has_objects: bool, faults: Collection[str] | None
) -> dict[str, str]:
    """List what never is in runs, by the signal that depends on it.

    Args:
        declared: The signals.
        has_objects: Whether there are objects.
        faults: Those that are injected; None where no signal of a fault is read.
    """
    missing = {
        name: NO_OBJECT for name, item in declared.items() if item.of_objects and not has_objects
    }
    if faults is not None:
        missing |= {
            name: f"fault {parts[1]} is not injected"
            for name in declared
            if (parts := name.split("."))[0] == "fault" and parts[1] not in faults
        }
        if not faults:
            missing["faulted"] = "no fault is injected"
    return missing


_BETWEEN: Final = 7
"""Times that are looked at from one row to the next, where the rows themselves decide nothing."""
_FOUND: Final[dict[tuple[object, ...], bool]] = {}


def first_constant(formula: Formula, runs: Sequence[Runs]) -> tuple[syntax.Node, bool] | None:
    """Find a part that always or never holds, whatever its signals are, as far as is found.

    A word or truth value by itself never does. What reads the time alone may: how long runs last
    is no matter of the formula, as long as this can fail, if only between the rows.

    Args:
        formula: The formula.
        runs: Those of its scenarios; one of them is enough.

    Returns:
        The first such part, innermost, and whether it always holds; None if there is none.
    """
    fails = can_fail(formula, runs)
    if not fails and formula.names == ("time",):
        fails = can_fail(formula, [item._replace(step_s=item.step_s / _BETWEEN) for item in runs])
    for part in reversed(list(syntax.walk(formula.root))[1:]):
        if not isinstance(part, syntax.Condition) or _is_free(part, fails=fails):
            continue
        for is_held in (True, False):
            node = part if is_held else syntax.Not(part.span, part)
            if math.isfinite(syntax.future_reach(part, is_outermost=False)):
                node = syntax.Temporal(part.span, "always", None, node)
            alone = replace(formula, root=node, names=syntax.names_in(part))
            if not can_fail(alone, runs):
                return part, is_held
    return None if fails else (formula.root, True)


def _is_free(part: syntax.Condition, *, fails: bool) -> bool:
    """Tell whether a part of a formula that fails, or not, needs no look."""
    if isinstance(part, syntax.Equality) and syntax.label_of(part) is not None:
        return True
    return isinstance(part, syntax.Assertion) or (fails and syntax.names_in(part) == ("time",))


def can_fail(formula: Formula, runs: Sequence[Runs]) -> bool:
    """Tell whether a run was found that fails a formula; arguments as above.

    The same again is remembered.
    """
    text = syntax.canonical(formula.root)
    for item in runs:
        types = tuple(item.declared[name] for name in formula.names)
        if (key := (text, types, *item[1:])) not in _FOUND:
            # What was compiled is known by its text.
            same = replace(formula, text=text)
            _FOUND[key] = _Search(same, item).succeeds()
        if _FOUND[key]:
            return True
    return False


def asks_nothing(formula: Formula, like: Runs, missing: Mapping[str, str]) -> str | None:
    """Say what a formula lacks that no run was found to fail in which some things never are.

    What is measured of objects is as it is without any, and no fault is present.

    Args:
        formula: The formula.
        like: What the runs are like: a time that none of them reaches asks for nothing, either.
        missing: What is not there, by the signal that depends on it.

    Returns:
        The first thing that is missing; None if the formula names none, or can fail all the same.
    """
    named = [name for name in formula.names if name in missing]
    declared = dict(like.declared)
    for name in named:
        item = declared[name]
        value = 0.0 if item.cap is None else math.inf
        labels = () if item.kind == "number" else (item.labels or TRUTH_LABELS)[:1]
        declared[name] = replace(item, least=value, most=value, most_per="", labels=labels)
    if not named or can_fail(formula, [like._replace(declared=declared)]):
        return None
    return missing[named[0]]


_ROUNDING: Final = Fraction(1, 10**12)
"""Numbers are no farther apart than units make them, that are by less than this part of what they
are made of: of a conversion or operation it is 1e-16."""
_OPERATIONS: Final[Mapping[str, Callable[..., Any]]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv,
    "min": min, "max": max, "abs": abs, "negate": operator.neg,
}  # fmt: skip


def _calculated(term: syntax.Term, at: Mapping[str, float], number: Any) -> tuple[Any, Any]:
    """Calculate a term in a kind of number, of which ``Fraction`` rounds nothing.

    Returns:
        It, and the size of what it is made of.
    """
    if not isinstance(term, syntax.Arithmetic):
        value = number(at[term.name] if isinstance(term, syntax.Signal) else term.value)
        # What is dropped by min or max, being no conflict, rounds nothing.
        return value, abs(value) if value < 1e300 else number()
    values, sizes = zip(*(_calculated(part, at, number) for part in term.operands), strict=True)
    size = math.prod(sizes) if term.operator in "*/" else max(sizes)
    if term.operator == "/":
        size /= values[1] ** 2
    return _OPERATIONS[term.operator](*values), size


def _may_be_apart(gap: syntax.Term, at: Mapping[str, float]) -> bool:
    """Tell whether it takes exact numbers, which are slow, to see a gap that is mere rounding."""
    with suppress(ArithmeticError):
        rounded, size = _calculated(gap, at, float)
        return not abs(rounded) <= size * float(_ROUNDING) / 2.0
    return True


def _times(formula: Formula) -> Iterator[float]:
    """List the times that a formula speaks of, 0 among them [s]."""
    yield 0.0
    for part in syntax.walk(formula.root):
        if window := syntax.window_of(part):
            yield from (window.first_s, window.last_s)
        elif isinstance(part, syntax.Constant) and part.exponents == Dimension.TIME.exponents:
            yield abs(part.value)


# --- Runs that are made up ------------------------------------------------------------------------

_STRETCHES, _NEAREST = 12, 16
"""In a run; and how many runs of a batch are altered in the next one."""
_RUNS, _FIRST_BATCH, _LARGEST_BATCH, _CELLS = 4096, 32, 256, 2**20
"""Made up at most; in the first batch; in one, and of how many rows of signals and conditions."""
_LARGEST: Final = 1e12
_SIGNS: Final = (-1.0, 1.0)
_FLIPPING_FIRST: Final = {"implies", "<", "<="}
_FLIPPING_LAST: Final = {"not", "fall", "-", "/", "negate", ">", ">="}
"""What is the larger, or holds the sooner, the smaller its first or last part is."""


def _pulls(node: syntax.Node, sign: int) -> Iterator[tuple[str, str, int]]:
    """List what pulls a part to where it holds or is large, else (-1) to where not.

    Yields:
        A signal; the word that does; 1 for this, or a large number, -1 for other words or a small.
    """
    match node:
        case syntax.Signal(name=name) | syntax.Assertion(name=name):
            yield name, "true", sign
        case syntax.Equality(left=syntax.Signal(name=name)) if word := syntax.label_of(node):
            yield name, word, -sign if node.is_negated else sign
        case _:
            head, parts = syntax.head_of(node), syntax.children(node)
            for part in parts:
                flipping = _FLIPPING_LAST if part is parts[-1] else _FLIPPING_FIRST
                yield from _pulls(part, -sign if head in flipping else sign)


def _ends(signal: SignalType, lasts_s: float) -> tuple[float, float]:
    """Return the least and the largest plausible value of a number in runs that last so long."""
    from adeye.spec.plausible import farthest

    far = farthest(unit_exponents(signal.unit) or (0, 0, 0))
    most = far if signal.most is None else signal.most
    most *= lasts_s if signal.most_per == "s" else 1.0
    least = -far if signal.least is None else max(-far, signal.least)
    return least, max(least, min(far, most))


def _near(name: str, parts: Sequence[syntax.Node]) -> list[float]:
    """List the numbers that a signal is compared with, and one between and beyond each two."""
    compared = (part for part in parts if isinstance(part, syntax.Comparison | syntax.Equality))
    beside = (syntax.walk(part) for part in compared if name in syntax.names_in(part))
    found = {part.value for part in chain(*beside) if isinstance(part, syntax.Constant)}
    numbers = sorted(min(max(number, -_LARGEST), _LARGEST) for number in found) or [0.0]
    between = ((low + high) / 2.0 for low, high in pairwise(numbers))
    return [*numbers, *between, numbers[0] - 1.0, numbers[-1] + 1.0]


class _Search:
    """The runs that are made up for one formula; a source of signals, as of one batch of B runs.

    Runs are lengths of stretches (B, K), in rows, and values (S, B, K) of the signals without time:
    numbers, or places of words.
    """

    def __init__(self, formula: Formula, like: Runs) -> None:
        ends = (like.horizon_s, like.horizon_s + like.tail_s)
        self._horizon, last = (syntax.last_row(end, like.step_s) for end in ends)
        self._formula, self._like, self._rows = formula, like, last + 1
        declared = {name: like.declared[name] for name in formula.names}
        self._bits = np.random.Philox(key=0)
        parts = list(syntax.walk(formula.root))
        constants = [part.value for part in parts if isinstance(part, syntax.Constant)]
        rows = {syntax.last_row(time, like.step_s) for time in _times(formula)}
        near = {row + more for row in rows for more in (-1, 0, 1, 2)}
        self._lengths = [*sorted(row for row in near if 0 < row < self._rows), self._rows]
        numbers = np.unique([0.0, 1.0, *constants])
        self._numbers = np.clip(numbers, -_LARGEST, _LARGEST)
        self._names = [name for name in declared if name != "time"]
        sizes = [_ends(declared[name], last * like.step_s) for name in self._names]
        self._least, self._most = np.reshape(sizes, (-1, 2, 1, 1)).swapaxes(0, 1)
        self._near = [_near(name, parts) for name in self._names]
        self._whole = np.reshape([declared[name].is_whole for name in self._names], (-1, 1, 1))
        labels = [declared[name].labels or TRUTH_LABELS for name in self._names]
        is_word = [declared[name].kind != "number" for name in self._names]
        self._words = np.reshape([*map(len, labels)], (-1, 1, 1)) * np.reshape(is_word, (-1, 1, 1))
        pulls = list(_pulls(formula.root, -1))
        self._pulls = [
            [(of.index(word), sign) for own, word, sign in pulls if own == name and word in of]
            for name, of in zip(self._names, labels, strict=True)
        ]
        cells = self._rows * (len(parts) + len(self._names))
        self._largest_batch = min(_LARGEST_BATCH, max(1, _CELLS // cells))

    def succeeds(self) -> bool:
        """Tell whether one of the runs fails the formula."""
        nearest: tuple[Ints, Floats] | None = None
        runs, done = min(_FIRST_BATCH, self._largest_batch), 0
        is_varied = np.where(self._words > 0, self._words > 1, self._least < self._most)
        # Where no signal varies, all runs are one.
        while done < (_RUNS if is_varied.any() else 1):
            lengths, values = self._runs = self._made_up(runs, nearest)
            every = np.ones(runs, dtype=np.int64)
            result = evaluate_columns(
                self._formula,
                self,
                step_s=self._like.step_s,
                length=self._rows * every,
                horizon=self._horizon * every,
                complete=every == 1,
                chosen=every == 1,
            )
            if self._fails(result):
                return True
            order = np.argsort(result.robustness_high)[:_NEAREST]
            nearest = lengths[order], values[:, order]
            done, runs = done + runs, min(2 * runs, self._largest_batch)
        return False

    def _fails(self, result: StlColumns) -> bool:
        """Tell whether a run that fails does so by its numbers, and not by how they are rounded."""
        failed = np.flatnonzero(result.verdict == VIOLATED)
        rows, gaps = result.row[failed], dict[int, syntax.Arithmetic]()
        for place in np.unique(result.node[failed]).tolist():
            node = result.program.conditions[place]
            if not isinstance(node, syntax.Comparison):
                return True
            gaps[place] = syntax.Arithmetic(node.span, "-", (node.left, node.right))
        names = {name for gap in gaps.values() for name in syntax.names_in(gap)}
        read = {name: np.nan_to_num(self.series(name).values[failed, rows]) for name in names}
        for index, run in enumerate(failed):
            gap = gaps[int(result.node[run])]
            at = {name: float(values[index]) for name, values in read.items()}
            is_tie = result.value[run] - result.threshold[run] == 0
            if is_tie or _may_be_apart(gap, at):
                with suppress(ZeroDivisionError):
                    exact, size = _calculated(gap, at, Fraction)
                    if (is_tie and exact == 0) or abs(exact) > _ROUNDING * size:
                        return True
        return False

    def series(self, name: str) -> Series:
        """Give the samples (B, T) of a signal."""
        lengths, values = self._runs
        shape = len(lengths), self._rows
        times = tick_times(np.arange(shape[1]), self._like.step_s)
        if name == "time":
            samples = np.broadcast_to(times, shape)
        else:
            ends = np.minimum(np.cumsum(lengths, axis=1), shape[1])
            ends[:, -1] = shape[1]
            repeats = np.diff(ends, axis=1, prepend=0)
            own = values[self._names.index(name)]
            samples = np.repeat(own.ravel(), repeats.ravel()).reshape(shape)
            if self._like.declared[name].most_per:
                # Nothing is older than the run.
                samples = np.minimum(samples, times)
            if word := self._like.declared[name].at_start:
                labels = self._like.declared[name].labels or TRUTH_LABELS
                samples[:, 0] = labels.index(word)
        status = np.where(np.isinf(samples), SampleStatus.NO_CONFLICT, SampleStatus.VALUE)
        return declared_series(self._like.declared[name], samples, status.astype(np.int8))

    def _shares(self, *shape: int) -> Floats:
        """Draw numbers from 0 to below 1."""
        raw = self._bits.random_raw(math.prod(shape))
        return np.reshape((raw >> np.uint64(11)) * 2.0**-53, shape)

    def _pick(self, options: Any, *shape: int) -> Any:
        return np.asarray(options)[(self._shares(*shape) * len(options)).astype(np.int64)]

    def _made_up(self, runs: int, nearest: tuple[Ints, Floats] | None) -> tuple[Ints, Floats]:
        """Make up runs; if there are any before, the nearest ones of them are altered."""
        every, shape = (runs, _STRETCHES), (len(self._names), runs, _STRETCHES)
        any_length = 1 + (self._shares(*every) * self._rows).astype(np.int64)
        lengths = np.where(
            self._shares(*every) < 0.1, any_length, self._pick(self._lengths, *every)
        )
        is_short = self._pick([True, False, False], runs, 1)
        lengths = np.where(is_short, self._pick([1, 1, 2], *every), lengths)
        values = self._values(shape)
        is_new = self._shares(*shape) < self._pick([0.2, 0.5, 1.0], 1, runs, 1)
        since = np.maximum.accumulate(np.where(is_new, np.arange(_STRETCHES), 0), axis=2)
        values = np.take_along_axis(values, since, axis=2)
        if nearest is None:
            return lengths, values
        parent = self._pick(range(len(nearest[0])), runs)
        rate = self._pick([0.03, 0.1, 0.3, 1.0], runs, 1)
        is_altered = self._shares(*every) < rate, self._shares(*shape) < rate
        return (
            np.where(is_altered[0], lengths, nearest[0][parent]),
            np.where(is_altered[1], values, nearest[1][:, parent]),
        )

    def _values(self, shape: tuple[int, int, int]) -> Floats:
        one, two = self._pick(self._numbers, *shape), self._pick(self._numbers, *shape)
        sign = self._pick(_SIGNS, *shape)
        size = 10.0 ** (8.0 * self._shares(*shape) - 3.0)
        offset = sign * self._pick([1e-6, 1e-3, 0.1, 1.0], *shape) * np.maximum(1.0, np.abs(one))
        beside, ratio = one + offset, one / np.where(two == 0.0, 1.0, two)
        both = one + two
        ways = [one, beside, beside, sign * size, both, both / 2.0, one - two, one * two, ratio]
        own = np.choose(self._pick(range(len(ways)), *shape), ways)
        near = np.reshape([self._pick(options, *shape[1:]) for options in self._near], shape)
        own = np.where(self._pick([True, False], *shape), near, own)
        other = np.take_along_axis(own, self._pick(np.arange(shape[0]), *shape), axis=0)
        factor = self._pick((0.0, 0.0, 0.0, *_SIGNS), *shape)
        own = np.where((factor != 0.0) & (sign > 0.0), 0.0, own) + factor * other
        pulls = [self._pick(options or [(0, 0)], *shape[1:]) for options in self._pulls]
        word, pull = np.moveaxis(np.reshape(pulls, (*shape, 2)), -1, 0)
        share = self._pick([0.0, 0.5, 0.9, 1.0], 1, shape[1], 1)
        is_pulled = (self._shares(*shape) < share) & (pull != 0)
        end = 2.0 * np.abs(self._numbers).max() + self._pick([0.0, 1.0, 100.0], *shape)
        # Nothing plausible is beyond.
        numbers = np.clip(np.where(is_pulled, pull * end, own), self._least, self._most)
        numbers = np.where(self._whole, np.floor(numbers), numbers)
        count = np.maximum(self._words, 1)
        others = (word + 1 + np.floor(self._shares(*shape) * (count - 1))) % count
        any_word = np.floor(self._shares(*shape) * count)
        words = np.where(is_pulled, np.where(pull > 0, word, others), any_word)
        return np.asarray(np.where(self._words > 0, words, numbers))
