"""How much of an ODD test cases cover: combinations of bins of its attributes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np

from adeye.sweep.bins import NO_BIN, bins_of, codes_of
from adeye.sweep.witness import Tuple, Witnesses, tuples_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from adeye.spec.bins import CoverageBins
    from adeye.spec.odd import Attributes
    from adeye.spec.scenario import LogicalScenario
    from adeye.sweep.bins import Bins
    from adeye.sweep.boundary import Columns


@dataclass(frozen=True, slots=True)
class Situations:
    """Planned points of one scenario, or those that were executed.

    Attributes:
        scenario: Overrides applied.
        columns: Its parameters in SI, scalars or (N,).
        count: N.
    """

    scenario: LogicalScenario
    columns: Columns
    count: int


@dataclass(frozen=True, slots=True)
class Combination:
    """What is covered of one attribute, or of some together.

    Attributes:
        attributes: Which.
        total: Combinations of their bins.
        feasible: Those that some scenario of the ODD can have.
        covered: Feasible ones that some situation has.
        uncovered: The others of the feasible ones, by the labels of their bins.
        impossible: Those that no scenario can have.
        counts: Situations of each covered one, in the order of the bins; one with actors of several
            kinds counts for each.
    """

    attributes: tuple[str, ...]
    total: int
    feasible: int
    covered: int
    uncovered: tuple[tuple[str, ...], ...]
    impossible: tuple[tuple[str, ...], ...]
    counts: tuple[tuple[tuple[str, ...], int], ...]


@dataclass(frozen=True, slots=True)
class Coverage:
    """What situations cover of an ODD.

    Attributes:
        situations: How many were looked at.
        outside: Those with an attribute in no bin, which count for the other attributes only.
        strength: Most attributes that are combined.
        combinations: One by one first, then together.
    """

    situations: int
    outside: int
    strength: int
    combinations: tuple[Combination, ...]


def coverage_of(
    attributes: Attributes,
    declared: CoverageBins | None,
    strength: int,
    situations: Iterable[Situations],
    others: Iterable[LogicalScenario] = (),
) -> Coverage:
    """Count what situations cover.

    Args:
        attributes: The ODD's.
        declared: Bins that it declares.
        strength: Most attributes that are combined, at least one.
        situations: Planned or executed ones.
        others: Scenarios of the ODD that none of the situations need have.
    """
    bins = bins_of(attributes, declared)
    sizes = range(1, strength + 1)
    counts: dict[Tuple, int] = {}
    scenarios: dict[int, LogicalScenario] = {id(item): item for item in others}
    looked = outside = 0
    for part in situations:
        scenarios[id(part.scenario)] = part.scenario
        if not part.count:
            continue
        codes = codes_of(part.scenario, part.columns, part.count, bins)
        looked += part.count
        # One with several values is in a bin if one of them is.
        missing = [np.atleast_2d(own == NO_BIN).all(axis=0) for own in codes.values()]
        outside += int(np.logical_or.reduce(missing).sum())
        for size in sizes:
            for key, count in tuples_of(codes, size).items():
                counts[key] = counts.get(key, 0) + count
    # What a situation has is feasible, however it came about.
    feasible = set(counts)
    for size in sizes:
        feasible |= Witnesses(scenarios.values(), bins, size).found
    found = tuple(
        _combination(names, bins, feasible, counts)
        for size in sizes
        for names in combinations(bins, size)
    )
    return Coverage(looked, outside, strength, found)


def _combination(
    names: tuple[str, ...], bins: Bins, feasible: set[Tuple], counts: dict[Tuple, int]
) -> Combination:
    uncovered: list[tuple[str, ...]] = []
    impossible: list[tuple[str, ...]] = []
    covered: list[tuple[tuple[str, ...], int]] = []
    for levels in product(*(range(len(bins[name])) for name in names)):
        labels = tuple(bins[name][level].label for name, level in zip(names, levels, strict=True))
        if (names, levels) in counts:
            covered.append((labels, counts[names, levels]))
        elif (names, levels) in feasible:
            uncovered.append(labels)
        else:
            impossible.append(labels)
    return Combination(
        names,
        len(covered) + len(uncovered) + len(impossible),
        len(covered) + len(uncovered),
        len(covered),
        tuple(uncovered),
        tuple(impossible),
        tuple(covered),
    )
