"""What is told of where an FSR fails, as typed records: tables and JSON show them."""

from __future__ import annotations

from typing import Literal

from adeye.report.model.part import Count, Id, Part

Trend = Literal["none", "upwards", "downwards", "not monotone", "not known"]


class Tally(Part):
    """Test cases by what they say of an FSR; what is no FAIL and no PASS is neither."""

    failed: Count = 0
    passed: Count = 0
    vacuous: Count = 0
    undecided: Count = 0
    """INCONCLUSIVE, INVALID, ERROR, or without a result that counts."""


class Level(Part):
    """The test cases with some values."""

    at: tuple[str, ...]
    """A value, or a range of values, of each axis asked for."""
    tally: Tally
    margin: float | None = None
    """The least one, in the unit of ``Site.unit``."""
    run: str = ""
    """Result digest of the run that has it."""


class AxisTold(Part):
    """What one axis has to do with failing, all others being equal."""

    name: Id
    is_ordered: bool
    values: Count
    lowest: str
    highest: str
    trend: Trend
    """Where more fails if nothing but this axis changes; an axis without an order has none."""
    lines: Count
    """Sets of test cases that differ in it alone and of which two or more PASS or FAIL."""
    changing: Count
    """Those in which both occur."""
    turning: Count
    """Those in which the verdict changes more than once along the axis."""
    levels: tuple[Level, ...]


class Separation(Part):
    """The smallest expression that holds failures apart from passes."""

    where: tuple[str, ...]
    """Conditions as ``sweep: where:`` takes them, all of which hold; none: everywhere."""
    faults: tuple[str, ...] = ()
    """Entries of the fault list, as ``faults:`` of a scenario takes them; none: all of them. A
    plan has the fault-free entry beside them."""
    keyword: str = ""
    """The same test cases as ``adeye run -k`` takes them; empty where that would be too long."""
    inside: Tally
    """Of the test cases that no separation before it is about."""
    outside: Tally
    is_exact: bool
    """Whether every box was looked at; else neighbouring values were taken together first."""


class Site(Part):
    """One architecture in one scenario, with the faults that have the same axes."""

    scenario: Id
    architecture: Id
    faults: tuple[str, ...]
    """Entries of the fault list."""
    tally: Tally
    margin: float | None = None
    unit: str = "1"
    """Of margins; "1" where they are divided by the scale of their signals."""
    run: str = ""
    separations: tuple[Separation, ...] = ()
    """The best, then what holds apart what those before it do not; none where nothing fails, or
    nothing passes."""
    axes: tuple[AxisTold, ...] = ()
    table: tuple[Level, ...] = ()
    """By the axes that were asked for."""


class FailureMap(Part):
    """Where an FSR fails at one site, by the axes that matter most there."""

    fsr: Id
    scenario: Id
    architecture: Id
    faults: tuple[str, ...] = ()
    """Entries of the fault list."""
    tally: Tally
    margin: float | None = None
    unit: str = "1"
    separation: Separation | None = None
    """What holds most failures apart; None where nothing passes."""
    by: tuple[Id, ...] = ()
    """At most two axes, the one that matters most last; none where no axis does."""
    down: tuple[str, ...] = ()
    """Values, or ranges of values, of the first of two axes, in their order."""
    across: tuple[str, ...] = ()
    """Those of the last axis."""
    left_out: tuple[Count, ...] = ()
    """Values of each axis, those with the fewest failures, that the map has no place for."""
    levels: tuple[Level, ...] = ()
    """What is there at the values of ``by``; some combinations may be planned nowhere."""
    command: str
    """Tells all of it."""

    def level(self, *at: str) -> Level | None:
        """Find what is at some values; None if nothing is planned there."""
        return next((level for level in self.levels if level.at == at), None)


class FailureMaps(Part):
    """Where FSRs fail."""

    maps: tuple[FailureMap, ...]
    """The most urgent first."""
    left_out: Count = 0
    """Sites with a failure for which there is no map."""
    command: str = ""
    """Lists what fails."""


class Where(Part):
    """Where among the swept values of a campaign an FSR fails."""

    campaign: Id
    number: Count
    odd: Id
    fsr: Id
    text: str
    measure: str
    by: tuple[str, ...]
    sites: tuple[Site, ...]

    @property
    def failed(self) -> int:
        """Test cases that fail it."""
        return sum(site.tally.failed for site in self.sites)

    @property
    def decided(self) -> int:
        """Test cases that fail or pass it."""
        return self.failed + sum(site.tally.passed for site in self.sites)
