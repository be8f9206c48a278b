"""Tell where among the swept values of a campaign an FSR fails, from the database alone.

A FAIL counts as a failure and a PASS as a pass. Whatever else a test case has, a withdrawn result
too, counts as neither, and is counted beside them.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.errors import UsageError, require_known, suggest
from adeye.judge.pairing import NOT_JUDGED, number_rows
from adeye.judge.verdict import FAIL, INCONCLUSIVE, PASS, VACUOUS
from adeye.notices import doing
from adeye.report.where import records
from adeye.report.where.boxes import Box, Scale, separate
from adeye.report.where.words import FAULT, Words, keyword
from adeye.store.read.bulk import Compared, Labels
from adeye.store.records import CampaignInfo
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from adeye.signals import Bools, Ints

BINS: Final = 8
"""Ranges of equally many values that an axis of more than ``boxes.LISTED`` is counted in."""
MOST_BOXES: Final = 3
"""Boxes of one site; each is about what those before it leave."""
MOST_BY: Final = 2
"""Axes of one table."""


def tell_where(
    repository: Repository,
    campaign: CampaignInfo,
    fsr: str,
    *,
    by: Sequence[str] = (),
    architectures: Collection[str] = (),
) -> records.Where:
    """Tell where an FSR fails.

    Args:
        repository: The database.
        campaign: The campaign.
        fsr: Id of the FSR.
        by: At most two axes to count by, ``fault`` among them; whole ids, or how they end.
        architectures: Those to look at; none: all.

    Raises:
        UsageError: The campaign has no such FSR, architecture or axis.
    """
    odd: Mapping[str, Any] = repository.content("odd", campaign.odd_digest)
    concept = repository.content("concept", campaign.concept_digest)
    known = {item["id"]: item for item in concept["requirements"]}
    require_known([fsr], known, lambda name: f"the campaign has no FSR {name!r}")
    require_known(
        architectures, odd["architectures"], lambda name: f"there is no architecture {name!r}"
    )
    if len(by) > MOST_BY:
        raise UsageError(f"--by has {len(by)} axes", remedy="Give one or two.")
    compared = repository.compared(
        campaign.id, list(architectures) or list(odd["architectures"]), is_named=True
    )
    told = list(cases_of(compared, fsr, odd))
    names = tuple(_axis_called(name, told) for name in by)
    return records.Where.of(
        campaign,
        campaign=campaign.id,
        fsr=fsr,
        text=known[fsr]["text"].strip(),
        measure=repository.measures(campaign.concept_digest)[fsr],
        by=names,
        sites=tuple(site.told(names) for site in told),
    )


def _axis_called(name: str, sites: Sequence[Cases]) -> str:
    """Find an axis by its name, or by how it ends behind a dot."""
    axes = dict.fromkeys(words.name for site in sites for words in site.words)
    found = [axis for axis in axes if axis == name] or [
        axis for axis in axes if axis.endswith(f".{name}")
    ]
    if len(found) == 1:
        return found[0]
    which = "is the end of more than one axis" if found else "is no axis of these test cases"
    raise UsageError(f"--by {name!r} {which}", remedy=suggest(name, found or list(axes)))


def cases_of(compared: Compared, fsr: str, odd: Mapping[str, Any]) -> Iterator[Cases]:
    """Take the test cases that an FSR is judged on apart, by scenario and architecture.

    Args:
        compared: Of the campaign, named.
        fsr: Id of the FSR.
        odd: Stored content of the ODD.
    """
    if fsr not in compared.fsrs:
        return
    column = compared.fsrs.index(fsr)
    points = [json.loads(text) for text in compared.place.words]
    judged = compared.verdict[:, column] != NOT_JUDGED
    # A fault's axes are there with the fault only, a sensor's with the sensor.
    axes = Labels.of([tuple(point) for point in points])
    site = number_rows(
        compared.scenario.codes, compared.architecture.codes, axes.codes[compared.place.codes]
    )
    parts = [
        np.flatnonzero((site == code) & judged)
        for code in np.flatnonzero(np.bincount(site[judged]))
    ]
    names = [(compared.scenario[rows[0]], compared.architecture[rows[0]]) for rows in parts]
    for rows, name in zip(parts, names, strict=True):
        found = Cases.read(compared, rows, column, (points, odd))
        yield replace(found, is_whole=names.count(name) == 1)


@dataclass(frozen=True, eq=False)
class Cases:
    """The test cases of one architecture in one scenario that an FSR is judged on, M of them.

    Attributes:
        scenario: Id.
        architecture: Id.
        faults: Entries of the fault list.
        words: A axes.
        codes: (M, A) which value each test case has.
        others: (M,) code of all but these that tells test cases apart.
        verdict: (M,) code.
        margin: (M,) in ``unit``, NaN where there is none.
        unit: Of the margins.
        result: (M,) digests.
        is_whole: Whether there are no others of this architecture in this scenario.
    """

    scenario: str
    architecture: str
    faults: tuple[str, ...]
    words: tuple[Words, ...]
    codes: Ints
    others: Ints
    verdict: Ints
    margin: Any
    unit: str
    result: tuple[str, ...]
    is_whole: bool = True

    @classmethod
    def read(
        cls,
        compared: Compared,
        rows: Ints,
        column: int,
        content: tuple[Sequence[Mapping[str, Any]], Mapping[str, Any]],
    ) -> Cases:
        """Read those of some rows.

        Args:
            compared: Of the campaign.
            rows: (M,) which.
            column: Of the FSR.
            content: Points of the design by code, and the stored content of the ODD.
        """
        points, odd = content
        scenario, architecture = compared.scenario[rows[0]], compared.architecture[rows[0]]
        own = compared.place.codes[rows]
        names = list(points[own[0]])
        columns = [_used(Labels.of([point.get(name) for point in points]), own) for name in names]
        words = [
            Words.of(name, values.words, _written(odd, scenario, name))
            for name, values in zip(names, columns, strict=True)
        ]
        columns.append(_used(compared.fault_entry, rows))
        words.append(Words(FAULT, tuple(sorted(columns[-1].words))))
        is_varied = [len(item.values) > 1 for item in words]
        measured = set(compared.measured[rows, column].tolist()) - {-1}
        is_plain = len(measured) < 2
        margin = (compared.margin if is_plain else compared.robustness)[rows, column]
        return cls(
            scenario,
            architecture,
            words[-1].values,
            tuple(item for item, varies in zip(words, is_varied, strict=True) if varies),
            np.stack(
                [
                    _ranked(values, item)
                    for values, item, varies in zip(columns, words, is_varied, strict=True)
                    if varies
                ],
                axis=1,
            )
            if any(is_varied)
            else np.zeros((len(rows), 0), dtype=np.int64),
            compared.replicate[rows],
            compared.verdict[rows, column],
            margin,
            compared.units[measured.pop()] if is_plain and measured else "1",
            tuple(compared.result[row] for row in rows.tolist()),
        )

    @property
    def failed(self) -> Bools:
        """Which test cases (M,) fail."""
        found: Bools = self.verdict == FAIL
        return found

    @property
    def passed(self) -> Bools:
        """Which test cases (M,) pass."""
        found: Bools = self.verdict == PASS
        return found

    def told(self, by: Sequence[str]) -> records.Site:
        """Tell of it, with a table by some axes."""
        everything = np.ones(len(self.verdict), dtype=np.bool_)
        margin, run = self._worst(everything)
        places = [place for place, item in enumerate(self.words) if item.name in by]
        places.sort(key=lambda place: by.index(self.words[place].name))
        return records.Site(
            scenario=self.scenario,
            architecture=self.architecture,
            faults=self.faults,
            tally=self._tally(everything),
            margin=margin,
            unit=self.unit,
            run=run,
            separations=tuple(found for found, _ in self._held_apart),
            axes=tuple(self._axis(place) for place in range(len(self.words))),
            table=self._levels(places) if by and len(places) == len(by) else (),
        )

    def _tally(self, mask: Bools) -> records.Tally:
        found = self.verdict[mask]
        failed, passed, vacuous = (int((found == code).sum()) for code in (FAIL, PASS, VACUOUS))
        undecided = len(found) - failed - passed - vacuous
        return records.Tally(failed=failed, passed=passed, vacuous=vacuous, undecided=undecided)

    def _worst(self, mask: Bools) -> tuple[float | None, str]:
        """Return margin and run of the worst as ``views.WORST_FIRST`` has it; nothing for none."""
        rows = np.flatnonzero(mask & (self._rank >= 0))
        ranks = self._rank[rows]
        same = rows[ranks == ranks.min()].tolist() if len(rows) else []
        worst = min(same, key=self.result.__getitem__, default=None)
        if worst is None or not (np.isfinite(self.margin[worst]) or self.failed[worst]):
            return None, ""
        margin = float(self.margin[worst])
        return margin if np.isfinite(margin) else None, self.result[worst]

    @cached_property
    def _rank(self) -> Ints:
        """Rank (M,) the test cases that were judged, the worst ones first; -1 for the others."""
        rows = np.flatnonzero(np.isin(self.verdict, (PASS, FAIL, INCONCLUSIVE)))
        is_known, held = np.isfinite(self.margin[rows]), ~self.failed[rows]
        keys = held, is_known != held, np.where(is_known, self.margin[rows], 0.0)
        order = np.lexsort(keys[::-1])
        is_next: Bools = np.zeros(len(rows), dtype=np.bool_)
        for key in keys:
            is_next[1:] |= key[order][1:] != key[order][:-1]
        rank: Ints = np.full(len(self.verdict), -1, dtype=np.int64)
        rank[rows[order]] = np.cumsum(is_next)
        return rank

    @cached_property
    def mattering(self) -> tuple[str, ...]:
        """At most two axes that tell most about failing, the one that tells most first.

        Those of the best box come before the others, of which those count that change the verdict
        alone, or at least the least margin; so an axis matters as ``told`` says that it does.
        """
        bounded = self._held_apart[0][1] if self._held_apart else ()

        def telling(place: int) -> tuple[bool, float, float]:
            axis = self._axis(place)
            margins = [level.margin for level in axis.levels if level.margin is not None]
            spread = max(margins) - min(margins) if margins else 0.0
            return place in bounded, axis.changing / max(axis.lines, 1), spread

        told = {place: telling(place) for place in range(len(self.words))}
        places = sorted((place for place in told if any(told[place])), key=told.__getitem__)
        return tuple(self.words[place].name for place in places[::-1][:MOST_BY])

    @cached_property
    def _held_apart(self) -> tuple[tuple[records.Separation, tuple[int, ...]], ...]:
        """What holds failures apart from passes, each with the axes that it bounds."""
        has_both = bool(self.failed.any() and self.passed.any())
        return tuple(self._separations()) if has_both else ()

    def _separations(self) -> Iterator[tuple[records.Separation, tuple[int, ...]]]:
        """Give the best box, then those that hold apart what the ones before it do not."""
        doing(f"Looking for what holds {int(self.failed.sum()):,} failures apart")
        scales = [
            Scale(len(item.values), item.is_ordered, item.name != FAULT) for item in self.words
        ]
        cell = number_rows(*self.codes.T, np.zeros(len(self.codes), dtype=np.int64))
        _, first = np.unique(cell, return_index=True)
        open_: Bools = np.ones(len(self.verdict), dtype=np.bool_)
        for number in range(MOST_BOXES):
            fails, passes = (
                np.bincount(cell[of & open_], minlength=len(first))
                for of in (self.failed, self.passed)
            )
            box = separate(self.codes[first], fails, passes, scales)
            if not box.holds(self.codes).any():
                # Few failures, which no box holds without more passes, are best told by none.
                box = Box({}, is_inverse=False, is_exact=box.is_exact)
            inside = box.holds(self.codes)
            gained = int(
                (open_ & inside & self.failed).sum() - (open_ & inside & self.passed).sum()
            )
            if number and (box.is_inverse or not box.chosen or gained <= 0):
                return
            where, faults = self._conditions(box)
            if not (self.is_whole or faults):
                faults = self.faults
            named = [
                (self.words[axis], levels)
                for axis, levels in box.chosen.items()
                if not levels.all() and self.words[axis].name != FAULT
            ]
            if faults:
                named.append((Words(FAULT, faults), np.ones(len(faults), dtype=np.bool_)))
            found = records.Separation(
                where=where,
                faults=faults,
                keyword="" if box.is_inverse else keyword(self.scenario, self.architecture, named),
                inside=self._tally(inside & open_),
                outside=self._tally(~inside & open_),
                is_exact=box.is_exact,
            )
            yield found, tuple(axis for axis, levels in box.chosen.items() if not levels.all())
            open_ &= ~inside
            if box.is_inverse or not (self.failed & open_).any():
                return

    def _conditions(self, box: Box) -> tuple[tuple[str, ...], tuple[str, ...]]:
        where, faults = list[str](), tuple[str, ...]()
        for axis, levels in box.chosen.items():
            words = self.words[axis]
            if levels.all():
                continue
            if words.name == FAULT:
                faults = tuple(words.values[place] for place in np.flatnonzero(levels).tolist())
            else:
                where.append(words.condition(levels))
        if box.is_inverse:
            return (f"not ({' and '.join(where)})",), faults
        return tuple(where), faults

    def _axis(self, place: int) -> records.AxisTold:
        words = self.words[place]
        changing, turning, rising, lines = self._lines(place)
        trend: records.Trend = "not known"
        if not words.is_ordered or not lines:
            trend = "not known"
        elif not changing:
            trend = "none"
        elif turning or 0 < rising < changing:
            trend = "not monotone"
        else:
            trend = "upwards" if rising else "downwards"
        return records.AxisTold(
            name=words.name,
            is_ordered=words.is_ordered,
            values=len(words.values),
            lowest=words.value(0),
            highest=words.value(len(words.values) - 1),
            trend=trend,
            lines=lines,
            changing=changing,
            turning=turning,
            levels=self._levels([place]),
        )

    def _lines(self, place: int) -> tuple[int, int, int, int]:
        """Count the lines along an axis: those that change, turn, rise, and all of them."""
        rows = np.flatnonzero(self.failed | self.passed)
        others = [self.codes[rows, at] for at in range(len(self.words)) if at != place]
        line = number_rows(*others, self.others[rows])
        order = np.lexsort((self.codes[rows, place], line))
        line, fails = line[order], self.failed[rows][order]
        count = int(line.max()) + 1 if len(line) else 0
        is_same = line[1:] == line[:-1]
        is_change = is_same & (fails[1:] != fails[:-1])
        several = np.bincount(line[1:][is_same], minlength=count) > 0
        turns = np.bincount(line[1:][is_change], minlength=count)
        rises = np.bincount(line[1:][is_change & fails[1:]], minlength=count)
        once = turns == 1
        return (
            int((turns > 0).sum()),
            int((turns > 1).sum()),
            int((once & (rises == 1)).sum()),
            int(several.sum()),
        )

    def _levels(self, places: Sequence[int]) -> tuple[records.Level, ...]:
        """Count by the values, or ranges of values, of some axes."""
        columns, names = [], []
        for place in places:
            words = self.words[place]
            size = len(words.values)
            if words.is_listed or not words.is_ordered:
                columns.append(self.codes[:, place])
                names.append([words.value(at) for at in range(size)])
                continue
            ends = [size * number // BINS for number in range(BINS + 1)]
            columns.append(np.searchsorted(ends, self.codes[:, place], side="right") - 1)
            names.append([words.span(low, high - 1) for low, high in pairwise(ends)])
        found = []
        for codes in sorted(set(zip(*(column.tolist() for column in columns), strict=True))):
            mask: Bools = np.ones(len(self.verdict), dtype=np.bool_)
            for column, code in zip(columns, codes, strict=True):
                mask &= column == code
            margin, run = self._worst(mask)
            at = tuple(names[place][code] for place, code in enumerate(codes))
            found.append(records.Level(at=at, tally=self._tally(mask), margin=margin, run=run))
        return tuple(found)


def _used(column: Labels, places: Ints) -> Labels:
    """Keep some places (M,) of a column, and the words that they have."""
    codes, found = np.unique(column.codes[places], return_inverse=True)
    return Labels(found.astype(np.int64), tuple(column.words[code] for code in codes.tolist()))


def _ranked(values: Labels, words: Words) -> Ints:
    """Give the place of each value (M,) among those of an axis."""
    own = values.words if words.is_ordered else map(str, values.words)
    place = {value: at for at, value in enumerate(words.values)}
    found: Ints = np.array([place[value] for value in own], dtype=np.int64)[values.codes]
    return found


def _written(odd: Mapping[str, Any], scenario: str, name: str) -> Any:
    """Give a value of an axis as it is written in the ODD, which tells its unit."""
    parameter = odd["scenarios"][scenario]["parameters"].get(name)
    if parameter is not None:
        return parameter["default"]
    for use in odd["odd"]["scenarios"]:
        if scenario in {use.get("as_id"), use["use"]}:
            sweep = use["sweep"]
            listed = [point[name] for point in sweep["points"] if name in point]
            return _first(sweep["parameters"].get(name, listed))
    return 0


def _first(written: Any) -> Any:
    """Give a value of what a sweep says of an axis: a list, steps, or a distribution."""
    if isinstance(written, list | tuple):
        return _first(written[0]) if written else 0
    if not isinstance(written, Mapping):
        return written
    if "empirical" in written:
        return f"1 {written.get('unit') or ''}"
    if "choice" in written:
        return next(iter(written["choice"]))
    return _first(next(iter(written.values())))
