"""Losses of margin against a baseline: how large, in how many pairs, and whether they count.

Where the points are a random sample the mean over points is tested; chosen points are no sample,
so there every pair counts, and the worst case.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.errors import UsageError
from adeye.evaluation.statistics import MIN_UNITS, RESOLUTION, bca, resampled_sums
from adeye.report.words import counted, quantity, unit_text
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.report.baseline import BaselineCase, BaselineCell
    from adeye.signals import Floats

NUMERIC: Final = 1e-6
"""Tolerance that always applies, relative and in the unit of the margin: a baseline is rounded."""
MOST_TOLERANCE: Final = 1_000.0
"""Largest loss of margin that somebody may mean, in any unit. Our choice."""
_VACUOUS: Final = "V"
"""Letter of a verdict whose margin says nothing."""
CONFIDENCE: Final = 0.95
"""Of the interval of a mean change."""


@dataclass(frozen=True, slots=True)
class Column:
    """Where an FSR is in the rows of test cases, and what its margins measure.

    Attributes:
        fsr: Id of the FSR.
        at: Its place in the rows.
        measure: Unit and signal; None where they differ between test cases.
    """

    fsr: str
    at: int
    measure: str | None


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Losses of margin that do not count.

    Attributes:
        sizes: Size by id of an FSR, or by unit for all others, as a margin has it.
        steps: Numeric uncertainty of the margin by FSR, architecture and scenario, and by unit:
            what the step is worth is no loss.
    """

    sizes: Mapping[str, float] = field(default_factory=dict)
    steps: Mapping[tuple[str, str, str], Mapping[str, float]] = field(default_factory=dict)

    @classmethod
    def given(cls, sizes: Mapping[str, float]) -> Tolerances:
        """Take sizes whose units may be written with ``^``.

        >>> Tolerances.given({"m/s^2": 0.1}).sizes
        {'m/s²': 0.1}
        """
        return cls({unit_text(name) or name: size for name, size in sizes.items()})

    def of(self, place: tuple[str, str, str], unit: str, value: float) -> float:
        """Give the loss that does not count, at least what rounding and the step make.

        Args:
            place: FSR, architecture and scenario.
            unit: Unit of the margin; ``1`` for one without or divided by its scale.
            value: Margin in the baseline.
        """
        return max(self.without_step(place[0], unit, value), self.step(place, unit))

    def without_step(self, fsr: str, unit: str, value: float) -> float:
        """Give the loss that does not count if the step were worth nothing."""
        numeric = NUMERIC * max(1.0, abs(value))
        return max(numeric, self.sizes.get(fsr, self.sizes.get(unit, 0.0)))

    def step(self, place: tuple[str, str, str], unit: str) -> float:
        """Give what the step is worth in a margin, 0 where that is not known."""
        return self.steps.get(place, {}).get(unit, 0.0)

    def check(self, fsrs: Sequence[str], units: Sequence[str]) -> None:
        """Refuse names that nothing has.

        Raises:
            UsageError: A name is neither an FSR nor a unit of a margin, or a size is not plausible.
        """
        for name, size in self.sizes.items():
            if not 0.0 <= size <= MOST_TOLERANCE:
                raise UsageError(
                    f"--tolerance of {shown(name)} is {size:g}, beyond which nothing would be lost",
                    remedy=f"Give 0 to {MOST_TOLERANCE:g}.",
                )
            if name not in {*fsrs, *units, "1"}:
                raise UsageError(
                    f"--tolerance {name!r} is neither an FSR nor a unit of a margin",
                    remedy=f"There are: {', '.join([*sorted(set(fsrs)), *sorted(set(units))])}.",
                )


@dataclass(frozen=True, slots=True)
class Loss:
    """What pairs lost.

    Attributes:
        text: For people.
        is_regression: Whether it counts.
        keys: Test cases that lost most, the worst first.
    """

    text: str
    is_regression: bool
    keys: tuple[str, ...]


def compare_cells(was: BaselineCell, has: BaselineCell, tolerances: Tolerances) -> str:
    """Compare worst margins of one cell; empty unless the worst is worse beyond tolerance.

    Args:
        was: Of the baseline.
        has: Of the campaign.
        tolerances: Losses that do not count.
    """
    if was.margin is None or has.margin is None or was.margin.unit != has.margin.unit:
        return ""
    unit, before, after = was.margin.unit, was.margin.value, has.margin.value
    tolerance = tolerances.of((was.fsr, was.architecture, was.scenario or ""), unit, before)
    if before - after <= tolerance:
        return ""
    return f"worst margin {_signed(after, unit)}, {_signed(before, unit)} in the baseline"


def compare_pairs(
    keys: Sequence[str],
    then: tuple[Mapping[str, BaselineCase], Column],
    now: tuple[Mapping[str, BaselineCase], Column],
    tolerances: Tolerances,
    *,
    points: Mapping[str, int] | None,
    place: tuple[str, str],
) -> Loss | None:
    """Compare the margins of pairs of test cases of one FSR.

    Args:
        keys: Test cases that both have.
        then: Those of the baseline by key, and where the FSR is.
        now: Those of the campaign.
        tolerances: Losses that do not count.
        points: Point of the design by key, if the points are a random sample.
        place: Architecture and scenario.

    Returns:
        None if no pair lost more than was given as tolerance; a loss that is no regression if the
        step is worth more than every pair lost.
    """
    measure = then[1].measure
    is_plain = measure is not None and measure == now[1].measure
    unit = measure.split(" ", 1)[0] if is_plain and measure else "1"
    pairs: list[tuple[str, float, float]] = []
    for key in keys:
        before, after = (
            (rows[key].margins if is_plain else rows[key].robustness)[column.at]
            for rows, column in (then, now)
        )
        is_judged = all(rows[key].verdicts[c.at] != _VACUOUS for rows, c in (then, now))
        if is_judged and before is not None and after is not None:
            pairs.append((key, before, after))
    at = (then[1].fsr, *place)
    lost = [
        item for item in pairs if item[1] - item[2] > tolerances.without_step(at[0], unit, item[1])
    ]
    if not lost:
        return None
    lost.sort(key=lambda item: (item[2] - item[1], item[0]))
    what = "margin" if is_plain else "margin divided by its scale"
    worst_before, worst_after = min(item[1] for item in pairs), min(item[2] for item in pairs)
    text = (
        f"{what} lost in {counted(len(lost))} of {counted(len(pairs))} pairs, most "
        f"{_signed(lost[0][2] - lost[0][1], unit)}; worst {_signed(worst_after, unit)}, "
        f"{_signed(worst_before, unit)} in the baseline"
    )
    worst = tuple(item[0] for item in lost)
    step = tolerances.step(at, unit)
    if step:
        text += f"; the step is worth {quantity(step, unit)}"
    if max(item[1] - item[2] for item in lost) <= step:
        return Loss(f"{text}, so nothing is known to be lost", is_regression=False, keys=worst)
    if points is None:
        return Loss(text, is_regression=True, keys=worst)
    tolerance = tolerances.of(at, unit, worst_before)
    return _tested(pairs, points, tolerance, (text, unit, place[1]), worst)


def _tested(
    pairs: Sequence[tuple[str, float, float]],
    points: Mapping[str, int],
    tolerance: float,
    said: tuple[str, str, str],
    worst: tuple[str, ...],
) -> Loss:
    """Test the mean change over drawn points; with too few of them every pair counts."""
    text, unit, name = said
    of_point: dict[int, list[float]] = defaultdict(list)
    for key, before, after in pairs:
        of_point[points[key]].append(after - before)
    means: Floats = np.array([np.mean(of_point[point]) for point in sorted(of_point)])
    if len(means) < MIN_UNITS:
        return Loss(f"{text}; too few points to test", is_regression=True, keys=worst)
    means = np.round(means / RESOLUTION) * RESOLUTION
    mean = float(means.mean())
    sums = resampled_sums(means[:, np.newaxis], name)[:, 0]
    found = bca(mean, sums / len(means), means - mean, CONFIDENCE)
    said_of = (
        f"{text}; mean change over {counted(len(means))} drawn points {_signed(mean, unit)} "
        f"[{_signed(found.low, unit)}, {_signed(found.high, unit)}], {CONFIDENCE:.0%}"
    )
    return Loss(said_of, is_regression=found.high < -tolerance, keys=worst)


def _signed(value: float, unit: str) -> str:
    return quantity(value, unit, signed=True)
