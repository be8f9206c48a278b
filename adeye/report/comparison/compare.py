"""Compare the architectures of a campaign on the same test cases; nothing is executed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any, Final

import numpy as np

from adeye.errors import UsageError
from adeye.judge.evaluate import FAIL, PASS, VERDICTS
from adeye.judge.pairing import counts_of, verdict_table
from adeye.judge.statistics import RESOLUTION, median_low
from adeye.report.claims import SHARED, designs_of, is_sample, spoken_of
from adeye.report.comparison import records
from adeye.report.comparison.candidates import Candidates, Matching
from adeye.report.comparison.inference import MarginBootstrap, Matched, PointCounts, Units, infer
from adeye.signals import Bools, Floats, Ints
from adeye.store.read.bulk import Compared
from adeye.store.records import CampaignInfo
from adeye.store.repository import Repository

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
