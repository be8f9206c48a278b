"""Expand an ODD into test cases: counted first, made lazily, grouped by structure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from adeye.errors import SpecError, SweepError
from adeye.sweep.clock import check_rates, check_times, guilty_path
from adeye.sweep.columns import CaseColumns, columns_of
from adeye.sweep.groups import Group, groups_of
from adeye.sweep.overrides import Variants
from adeye.sweep.points import read_points
from adeye.sweep.sections import Section, overlapping, sections_of
from adeye.sweep.shared import Shared, shared_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from adeye.spec.load import Loaded, OddFiles
    from adeye.sweep.case import TestCase
    from adeye.sweep.design import Points

CHUNK: Final = 1_024
"""Test cases that are made together."""


@dataclass(frozen=True)
class Factor:
    """How the test cases of one scenario and architecture are counted.

    Attributes:
        scenario: Id of the scenario in the ODD.
        architecture: Id of the architecture.
        raw: Combinations before constraints.
        points: Feasible points, without axes that the architecture does not have.
        fault_entries: Entries that fit the architecture, ``none`` first.
        replicates: Number of replicates.
        test_cases: How many test cases this makes.
    """

    scenario: str
    architecture: str
    raw: int
    points: int
    fault_entries: tuple[str, ...]
    replicates: int
    test_cases: int


@dataclass(frozen=True)
class Expansion:
    """The counted plan of an ODD; test cases are made as they are asked for.

    Attributes:
        files: The ODD and everything it names.
        factors: How the test cases are counted.
        axes: Swept names by scenario.
        points: Points of the design by scenario.
        sections: Its test cases in order, those together that share one variant of each file.
    """

    files: OddFiles
    factors: tuple[Factor, ...]
    axes: Mapping[str, tuple[str, ...]]
    points: Mapping[str, Points]
    sections: tuple[Section, ...]
    _variants: Variants

    @property
    def count(self) -> int:
        """Number of test cases."""
        return sum(factor.test_cases for factor in self.factors)

    def cases(self, start: int = 0, stop: int | None = None) -> Iterator[TestCase]:
        """Make the test cases of an ordinal range, by default all, in the order of the plan.

        Args:
            start: First ordinal.
            stop: Ordinal behind the last.

        Raises:
            SweepError: A point is outside the ODD and the ODD refuses such, or a value that the
                sweep writes into a file is not valid there.
        """
        for columns in self.columns(start, stop):
            yield from columns.cases()

    def columns(
        self, start: int = 0, stop: int | None = None, size: int = CHUNK
    ) -> Iterator[CaseColumns]:
        """Make the test cases of an ordinal range as columns; those before cost nothing.

        Args:
            start: First ordinal.
            stop: Ordinal behind the last.
            size: Most test cases at once.

        Raises:
            SweepError: As for ``cases``.
        """
        end = self.count if stop is None else min(stop, self.count)
        for section, low, high in overlapping(self.sections, start, end):
            shared = self.shared(section)
            for first in range(low, high, size):
                yield columns_of(self.files, section, shared, first, min(first + size, high))

    def shared(self, section: Section) -> Shared:
        """Apply what the sweep writes into the files of a section.

        Raises:
            SweepError: A value is not valid where the sweep writes it.
        """
        return shared_of(self.files, section, self._variants)


def expand(files: OddFiles) -> Expansion:
    """Count the test cases of an ODD and prepare their expansion.

    Args:
        files: The ODD and everything it names.

    Raises:
        SweepError: An axis, a relation or the number of test cases is not acceptable.
    """
    odd = files.odd.spec
    groups: list[Group] = []
    factors: list[Factor] = []
    axes: dict[str, tuple[str, ...]] = {}
    designed: dict[str, Points] = {}
    for number, use in enumerate(odd.scenarios):
        read, points = read_points(files, number)
        axes[use.name] = tuple(axis.name for axis in read)
        designed[use.name] = points
        for architecture in files.architectures.values():
            made = groups_of(files, number, architecture, read, points)
            groups += made
            cases = sum(len(group.rows) for group in made) * odd.replicates
            entries = tuple(group.entry for group in made)
            factors.append(
                Factor(
                    use.name,
                    architecture.spec.architecture,
                    points.raw,
                    len(made[0].rows),
                    entries,
                    odd.replicates,
                    cases,
                )
            )
    sections = sections_of(groups, odd.replicates)
    expansion = Expansion(files, tuple(factors), axes, designed, sections, Variants())
    _check_limit(expansion)
    _check_clock(files)
    return expansion


def _check_limit(expansion: Expansion) -> None:
    odd = expansion.files.odd
    if expansion.count > odd.spec.max_test_cases:
        worst = max(expansion.factors, key=lambda factor: factor.test_cases)
        raise SweepError(
            f"the plan has {expansion.count:,} test cases, above the limit of "
            f"{odd.spec.max_test_cases:,}; most are in {worst.scenario} with "
            f"{worst.architecture} ({worst.test_cases:,})",
            where=odd.locate(("scenarios",)),
            remedy="Narrow the sweeps, or raise max_test_cases in the ODD.",
        )


def _check_clock(files: OddFiles) -> None:
    step = files.odd.spec.step
    for architecture in files.architectures.values():
        try:
            check_rates(architecture.spec, step)
        except SpecError as error:
            raise _placed(error, architecture) from error
    for scenario in files.scenarios.values():
        try:
            check_times(scenario.spec, step)
        except SpecError as error:
            raise _placed(error, scenario) from error


def _placed(error: SpecError, loaded: Loaded[Any]) -> SpecError:
    """Find the place of an error whose message begins with a dotted path."""
    where = loaded.locate(guilty_path(error))
    return SpecError(error.message, where=where, remedy=error.remedy)
