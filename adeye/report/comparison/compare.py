"""Compare the architectures of a campaign on the same test cases; nothing is executed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any, Final

import numpy as np

from adeye.errors import UsageError
from adeye.judge import statistics
from adeye.judge.pairing import Groups, counts_of, severities, verdict_table
from adeye.judge.statistics import RESOLUTION, median_low
from adeye.judge.verdict import FAIL, PASS, VERDICTS
from adeye.report.claims import SHARED, designs_of, is_sample, spoken_of
from adeye.report.comparison import records
from adeye.report.comparison.candidates import Candidates, Matching
from adeye.report.comparison.records import Inference, Range
from adeye.signals import Bools, Floats, Ints
from adeye.store.read.bulk import Compared
from adeye.store.records import CampaignInfo
from adeye.store.repository import Repository

# --- What may be said beyond the runs themselves: only where the design is a random sample --------
# The unit is the drawn point, not the run: the runs of one point, with its faults and replicates,
# are no independent draws. A point fails if any of its runs does. Whether a point is undecided may
# depend on what happened there, so it is not left out: it counts against what would be found. A
# point that lacks a run is undecided, too, because all drawn points are the sample.


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
        Inference.of(
            item,
            only_a_fails=item.only_a,
            only_b_fails=item.only_b,
            difference=(item.only_b - item.only_a) / item.units,
            interval=item.range(confidence),
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


_WORDS: Final = (*map(str, VERDICTS), "NOT_RUN")


def compare(
    repository: Repository, campaign: CampaignInfo, options: records.CompareOptions | None = None
) -> records.Comparison:
    """Compare architectures of a campaign.

    Args:
        repository: The database.
        campaign: The campaign.
        options: What is compared; default: all architectures, every pair.

    Raises:
        UsageError: An architecture is unknown, there are fewer than two, or two share no test
            case.
    """
    options = options or records.CompareOptions()
    odd: Mapping[str, Any] = repository.content("odd", campaign.odd_digest)
    names = options.chosen(list(odd["architectures"]))
    options.check()
    compared = repository.compared(campaign.id, names)
    return _Comparer(repository, campaign, odd, names, options, compared).compare()


def overview(
    repository: Repository, campaign: CampaignInfo, odd: Mapping[str, Any]
) -> records.Comparison | None:
    """Compare all architectures as far as a report shows it: no differences by scenario.

    Args:
        repository: The database.
        campaign: The campaign.
        odd: Stored content of its ODD.

    Returns:
        None for fewer than two architectures, or if they share no test case.
    """
    names = list(odd["architectures"])
    baseline = campaign.gate[0] if len(campaign.gate) == 1 else None
    if len(names) < 2:
        return None
    try:
        found = compare(repository, campaign, records.CompareOptions(baseline=baseline))
    except UsageError:
        # Each may be made for scenarios or faults of its own; then there is nothing to say.
        return None
    kept = tuple(item for item in found.differences if item.kind == "all")
    return found.model_copy(update={"differences": kept})


@dataclass(frozen=True)
class _Cluster:
    kind: records.ClusterKind
    name: str
    scenarios: tuple[int, ...]


@dataclass(frozen=True)
class _Comparer:
    repository: Repository
    campaign: CampaignInfo
    odd: Mapping[str, Any]
    names: Sequence[str]
    options: records.CompareOptions
    compared: Compared

    @cached_property
    def designs(self) -> dict[str, str]:
        return designs_of(self.odd)

    @cached_property
    def matching(self) -> Matching:
        return Matching(self.compared)

    def compare(self) -> records.Comparison:
        options, compared = self.options, self.compared
        others = [name for name in self.names if name != options.baseline]
        chosen = (
            list(combinations(self.names, 2))
            if options.baseline is None
            else [(options.baseline, name) for name in others]
        )
        pairs = [self._matched(a, b) for a, b in chosen]
        candidates = Candidates(self.repository, self.campaign, self.odd, self.names, self.matching)
        return records.Comparison(
            campaign=self.campaign.id,
            odd=self.campaign.odd,
            title=self.campaign.title,
            baseline=options.baseline,
            confidence=options.confidence,
            designs={
                name: design
                for name, design in self.designs.items()
                if name in compared.scenario.words
            },
            statements=(SHARED, *spoken_of(self.designs, compared.scenario.words)),
            **candidates.judge(options.objectives, options.epsilon),
            fsrs=tuple(candidates.fsrs),
            pairs=tuple(self._pair(pair) for pair in pairs),
            differences=tuple(self._differences(pairs)),
            contributions=candidates.contributions(),
            sightings=candidates.sightings(),
        )

    # Pairs

    def _matched(self, a: str, b: str) -> Matched:
        rows_a, rows_b = self.matching.pairs(a, b)
        if not len(rows_a):
            raise UsageError(
                f"{a} and {b} share no test case in campaign {self.campaign.id[:10]}",
                remedy="Compare architectures that meet the same scenarios, faults and points.",
            )
        done = self.compared.is_done[rows_a] & self.compared.is_done[rows_b]
        change, units, is_normalised = _change(self.compared, rows_a, rows_b)
        return Matched(a, b, rows_a, rows_b, done, change, units, is_normalised)

    def _pair(self, pair: Matched) -> records.Pair:
        compared = self.compared
        verdict_a, verdict_b = compared.verdict[pair.rows_a], compared.verdict[pair.rows_b]
        # An FSR may be asked for outside the ODD only, and then is judged on neither.
        alone = ((verdict_a >= 0).any(axis=0)) != ((verdict_b >= 0).any(axis=0))
        return records.Pair(
            a=pair.a,
            b=pair.b,
            pairs=int(pair.is_done.sum()),
            incomplete=int((~pair.is_done).sum()),
            only_a=len(self.matching.rows(pair.a)) - len(np.unique(pair.rows_a)),
            only_b=len(self.matching.rows(pair.b)) - len(np.unique(pair.rows_b)),
            not_comparable=tuple(
                name for name, is_alone in zip(compared.fsrs, alone, strict=True) if is_alone
            ),
        )

    # Differences

    def _clusters(self) -> list[_Cluster]:
        words = self.compared.scenario.words
        clusters = [_Cluster("all", "", tuple(range(len(words))))]
        if len(words) > 1:
            clusters += [_Cluster("scenario", name, (code,)) for code, name in enumerate(words)]
        categories: dict[str, list[int]] = {}
        for code, name in enumerate(words):
            tag = self.odd["scenarios"][name]["tags"].get("iso34502") or ""
            categories.setdefault(tag.partition("/")[0].strip(), []).append(code)
        if len(categories) > 1:
            clusters += [
                _Cluster("category", name or "without a category", tuple(codes))
                for name, codes in sorted(categories.items())
            ]
        return clusters

    def _differences(self, pairs: Sequence[Matched]) -> list[records.Difference]:
        bootstrap = MarginBootstrap(self.compared, pairs, self.designs)
        found: list[records.Difference] = []
        for cluster in self._clusters():
            made: list[records.Difference] = []
            counts: list[PointCounts] = []
            words = self.compared.scenario.words
            is_drawn = all(is_sample(self.designs[words[code]]) for code in cluster.scenarios)
            for number, pair in enumerate(pairs):
                planned = np.isin(self.compared.scenario.codes[pair.rows_a], cluster.scenarios)
                inside = planned & pair.is_done
                is_complete = bool((inside == planned).all())
                units = Units.of(self.compared, pair) if is_drawn else None
                for fsr in range(len(self.compared.fsrs)):
                    item = self._difference(pair, cluster, inside, fsr)
                    if item is None:
                        continue
                    if units is not None:
                        counts.append(units.counts(cluster.scenarios, fsr))
                        interval = bootstrap.interval(
                            cluster.scenarios, number, fsr, self.options.confidence
                        )
                        if item.margin is not None and item.undecided == 0 and is_complete:
                            margin = item.margin.model_copy(update={"interval": interval})
                            item = item.model_copy(update={"margin": margin})
                    made.append(item)
            inferred: Sequence[records.Inference | None] = [None] * len(made)
            if counts:
                inferred = infer(counts, self.options.confidence)
            found += [
                item.model_copy(update={"inference": said})
                for item, said in zip(made, inferred, strict=True)
            ]
        return found

    def _difference(
        self, pair: Matched, cluster: _Cluster, inside: Bools, fsr: int
    ) -> records.Difference | None:
        """Compare one FSR; None if it is judged on no pair."""
        compared = self.compared
        a = compared.verdict[pair.rows_a[inside], fsr]
        b = compared.verdict[pair.rows_b[inside], fsr]
        table = verdict_table(a, b)
        counts = counts_of(table)
        if counts.pairs == 0:
            return None
        return records.Difference.of(
            counts,
            inference=None,
            fsr=compared.fsrs[fsr],
            a=pair.a,
            b=pair.b,
            kind=cluster.kind,
            cluster=cluster.name,
            verdicts={
                f"{_WORDS[row]}/{_WORDS[column]}": int(table[row, column])
                for row, column in np.argwhere(table > 0).tolist()
            },
            difference=(counts.only_b_fails - counts.only_a_fails) / counts.decided
            if counts.decided
            else None,
            margin=self._margin(pair, inside, fsr),
        )

    def _margin(self, pair: Matched, inside: Bools, fsr: int) -> records.MarginDifference | None:
        change = pair.change[inside, fsr]
        places = np.flatnonzero(np.isfinite(change))
        if not len(places):
            return None
        values = change[places]
        result = self.compared.result
        ties = np.flatnonzero(inside)[places[values == values.min()]].tolist()
        worst = min(ties, key=lambda at: result[int(pair.rows_b[at])])
        return records.MarginDifference(
            unit=pair.units[fsr],
            is_normalised=pair.is_normalised[fsr],
            pairs=len(values),
            mean=float(values.mean()),
            median=median_low(values),
            least=float(values.min()),
            greatest=float(values.max()),
            least_run_a=result[int(pair.rows_a[worst])],
            least_run_b=result[int(pair.rows_b[worst])],
        )


def _change(
    compared: Compared, rows_a: Ints, rows_b: Ints
) -> tuple[Floats, tuple[str, ...], tuple[bool, ...]]:
    """Subtract margins where both PASS or FAIL.

    In their own unit where one signal binds throughout; otherwise divided by the signals' scales.
    """
    judged = np.isin(compared.verdict[rows_a], (PASS, FAIL)) & np.isin(
        compared.verdict[rows_b], (PASS, FAIL)
    )
    change = np.full(judged.shape, np.nan)
    units: list[str] = []
    is_normalised: list[bool] = []
    for fsr in range(judged.shape[1]):
        own = judged[:, fsr]
        a, b = rows_a[own], rows_b[own]
        signals = np.unique(np.concatenate([compared.measured[a, fsr], compared.measured[b, fsr]]))
        is_one = len(signals) == 1 and signals[0] >= 0
        is_measured = bool((signals >= 0).any())
        source = compared.margin if is_one else compared.robustness
        if is_measured:
            # Below the resolution is rounding of the simulation, and no change.
            steps = np.round((source[b, fsr] - source[a, fsr]) / RESOLUTION)
            change[own, fsr] = steps * RESOLUTION + 0.0
        units.append(compared.units[int(signals[0])] if is_one else "1")
        is_normalised.append(is_measured and not is_one)
    return change, tuple(units), tuple(is_normalised)
