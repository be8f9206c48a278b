"""What may be said beyond the runs themselves: only where the design is a random sample.

The unit is the drawn point, not the run: the runs of one point, with its faults and replicates,
are no independent draws. A point fails if any of its runs does. Whether a point is undecided may
depend on what happened there, so it is not left out: it counts against what would be found. A
point that lacks a run is undecided, too, because all drawn points are the sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from adeye.judge import statistics
from adeye.judge.pairing import Groups, severities
from adeye.report.claims import is_sample
from adeye.report.comparison.records import Inference, Range
from adeye.signals import Bools, Floats, Ints
from adeye.store.read.bulk import Compared


@dataclass(frozen=True, eq=False)
class Matched:
    """Two architectures on the same test cases.

    Attributes:
        a: Id.
        b: Id.
        rows_a: (P,) case of A in each planned pair.
        rows_b: (P,) case of B.
        is_done: (P,) whether both were executed.
        change: (P, F) margin of B minus that of A; NaN where one has none.
        units: Unit of the change by FSR.
        is_normalised: Whether the change is in robustness, by FSR.
    """

    a: str
    b: str
    rows_a: Ints
    rows_b: Ints
    is_done: Bools
    change: Floats
    units: tuple[str, ...]
    is_normalised: tuple[bool, ...]


@dataclass(frozen=True, eq=False)
class Units:
    """The drawn points of a pair and whether the FSRs failed there.

    Attributes:
        scenario: (G,) code of the scenario.
        a: (G, F) worst severity over the runs of A.
        b: (G, F) the same of B.
    """

    scenario: Ints
    a: Ints
    b: Ints

    @classmethod
    def of(cls, compared: Compared, pair: Matched) -> Units:
        """Fold the runs of each point."""
        groups = Groups.of(compared.point[pair.rows_a])
        first = pair.rows_a[groups.order[groups.starts]]
        return cls(
            compared.scenario.codes[first],
            groups.worst(severities(compared.verdict[pair.rows_a])),
            groups.worst(severities(compared.verdict[pair.rows_b])),
        )

    def counts(self, scenarios: Sequence[int], fsr: int) -> PointCounts:
        """Count the points of some scenarios by who failed."""
        inside = np.isin(self.scenario, scenarios) & (self.a[:, fsr] >= 0) & (self.b[:, fsr] >= 0)
        table = np.bincount(self.a[inside, fsr] * 3 + self.b[inside, fsr], minlength=9)
        return PointCounts(*table.tolist())


@dataclass(frozen=True, slots=True)
class PointCounts:
    """Drawn points by what is known of A and of B: it held, is undecided, or failed there."""

    neither: int = 0
    held_open: int = 0
    only_b: int = 0
    open_held: int = 0
    open_open: int = 0
    open_failed: int = 0
    only_a: int = 0
    failed_open: int = 0
    both: int = 0

    @property
    def undecided(self) -> int:
        """Points of which it is not known for both whether they failed."""
        return (
            self.held_open + self.open_held + self.open_open + self.open_failed + self.failed_open
        )

    @property
    def units(self) -> int:
        """All points."""
        return self.both + self.only_a + self.only_b + self.neither + self.undecided

    @property
    def most_a(self) -> int:
        """Points in which only A failed, if every undecided one that can be is one of them."""
        return self.only_a + self.failed_open + self.open_held + self.open_open

    @property
    def most_b(self) -> int:
        """The same for B."""
        return self.only_b + self.open_failed + self.held_open + self.open_open

    @property
    def p(self) -> float:
        """McNemar's p if all that is undecided spoke for the side with fewer failures."""
        if self.only_a >= self.only_b:
            return statistics.mcnemar_p(self.only_a, min(self.only_a, self.most_b))
        return statistics.mcnemar_p(min(self.only_b, self.most_a), self.only_b)

    def range(self, confidence: float) -> Range:
        """Interval that holds whatever the undecided points are."""
        low = statistics.paired_difference(
            self.both + self.open_failed,
            self.most_a,
            self.only_b,
            self.neither + self.held_open,
            confidence,
        )
        high = statistics.paired_difference(
            self.both + self.failed_open,
            self.only_a,
            self.most_b,
            self.neither + self.open_held,
            confidence,
        )
        return Range(low=low.low, high=high.high)


def infer(counts: Sequence[PointCounts], confidence: float) -> list[Inference | None]:
    """Test every FSR and pair of one cluster together.

    Args:
        counts: One entry a test.
        confidence: Of the intervals, which are not adjusted.

    Returns:
        One for each entry; None where no point is judged.
    """
    tested = [item for item in counts if item.units > 0]
    adjusted = iter(statistics.holm([item.p for item in tested]))
    return [
        Inference(
            units=item.units,
            only_a_fails=item.only_a,
            only_b_fails=item.only_b,
            undecided=item.undecided,
            difference=(item.only_b - item.only_a) / item.units,
            interval=item.range(confidence),
            p=item.p,
            p_adjusted=next(adjusted),
        )
        if item.units > 0
        else None
        for item in counts
    ]


class MarginBootstrap:
    """Bootstrap of mean margin changes, stratified by scenario; all pairs share the draws."""

    def __init__(
        self, compared: Compared, pairs: Sequence[Matched], designs: Mapping[str, str]
    ) -> None:
        """Draw once for every scenario with a random design.

        Args:
            compared: Cases with their verdicts.
            pairs: What is compared.
            designs: Design by scenario.
        """
        self._width = len(compared.fsrs)
        self._values: dict[int, Floats] = {}
        self._sums: dict[int, Floats] = {}
        self._counts: dict[int, Floats] = {}
        for code, name in enumerate(compared.scenario.words):
            if is_sample(designs[name]):
                values = self._table(compared, pairs, code)
                known = np.isfinite(values)
                filled = np.where(known, values, 0.0)
                partial = ~known.all(axis=0) & known.any(axis=0)
                both = np.concatenate([filled, known[:, partial].astype(np.float64)], axis=1)
                sums = statistics.resampled_sums(both, name)
                counts = np.where(known.all(axis=0), float(len(values)), 0.0)
                counts = np.broadcast_to(counts, (len(sums), len(counts))).copy()
                counts[:, partial] = sums[:, values.shape[1] :]
                self._values[code] = values
                self._sums[code] = sums[:, : values.shape[1]]
                self._counts[code] = counts

    def _table(self, compared: Compared, pairs: Sequence[Matched], code: int) -> Floats:
        """Return the mean change (U, C) of each point of a scenario, by pair and FSR."""
        points = np.unique(compared.point[compared.scenario.codes == code])
        values = np.full((len(points), len(pairs) * self._width), np.nan)
        for number, pair in enumerate(pairs):
            own = compared.scenario.codes[pair.rows_a] == code
            if own.any():
                groups = Groups.of(compared.point[pair.rows_a[own]])
                rows = np.searchsorted(points, groups.keys)
                columns = slice(number * self._width, (number + 1) * self._width)
                values[rows, columns] = groups.mean(pair.change[own])
        return np.asarray(
            np.round(values / statistics.RESOLUTION) * statistics.RESOLUTION, dtype=np.float64
        )

    def interval(
        self, scenarios: Sequence[int], pair: int, fsr: int, confidence: float
    ) -> Range | None:
        """Interval of the mean change over some scenarios; None if too few points have one."""
        column = pair * self._width + fsr
        values = [self._values[code][:, column] for code in scenarios]
        values = [item[np.isfinite(item)] for item in values]
        units = sum(map(len, values))
        if units < statistics.MIN_UNITS:
            return None
        counts = np.sum([self._counts[code][:, column] for code in scenarios], axis=0)
        if not counts.min() > 0.0:
            return None
        sums = np.sum([self._sums[code][:, column] for code in scenarios], axis=0)
        observed = float(np.sum([item.sum() for item in values])) / units
        influence = np.concatenate([item - item.mean() for item in values if len(item)])
        found = statistics.bca(observed, sums / counts, influence, confidence)
        return Range(low=found.low, high=found.high)
