"""The pictures of faults: the times of the worst runs as bars, and what a parameter trades.

Places only: bars in percent of their width, the curve in a box of ``WIDTH`` by ``HEIGHT``; the
template writes them as SVG.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from adeye.report.front import HEIGHT, WIDTH, Tick, place, ticks
from adeye.report.labels import Box, Label, place_labels
from adeye.report.words import number, quantity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.report.fault_parts import FaultEvidence, FaultGroup, TradeCurve, WorstInjection

_LEFT, _RIGHT, _TOP, _BOTTOM = 64.0, 24.0, 24.0, 46.0
_WIDEST: Final = 2.5
"""The axis of the bars is at most so many times as long as what has to be seen on it."""
_LEAST: Final = 0.35
"""Least width of a bar [%], so that a short time is not taken for none."""


@dataclass(frozen=True, slots=True)
class Span:
    """A part of a bar, in percent."""

    x: float
    width: float


@dataclass(frozen=True, slots=True)
class Bar:
    """The times of the worst run of a group.

    Attributes:
        group: Whose they are.
        fdti: From the fault to its detection; None without.
        frti: From there to safe state or emergency operation; None without.
        open_from: Where the bar begins that never ends, because nobody detects or handles the
            fault [%]; None if it is handled.
        ftti: Where the tolerated time ends [%]; None where nothing is violated.
        is_cut: Whether it ends beyond the picture.
        is_late: Whether the fault is handled too late or never.
        text: The times in words.
    """

    group: FaultGroup
    fdti: Span | None
    frti: Span | None
    open_from: float | None
    ftti: float | None
    is_cut: bool
    is_late: bool
    text: str


@dataclass(frozen=True, slots=True)
class Bars:
    """All bars on one axis of time."""

    bars: tuple[Bar, ...]
    ticks: tuple[Tick, ...]


def draw_bars(evidence: FaultEvidence) -> Bars | None:
    """Place the times of the worst run of each group whose fault was activated."""
    groups = [group for group in evidence.groups if group.worst.class_ != "not_activated"]
    if not groups:
        return None
    marks = ticks(0.0, _reach([group.worst for group in groups]))
    end = marks[-1]
    shown = tuple(Tick(100.0 * mark / end, f"{mark:g}") for mark in marks)
    return Bars(tuple(_bar(group, end) for group in groups), shown)


def _reach(worst: Sequence[WorstInjection]) -> float:
    """Choose how much time is shown: everything that is handled, and the nearer ends of FTTIs."""
    handled = max((item.fhti_s or item.fdti_s or 0.0 for item in worst), default=0.0)
    tolerated = [item.ftti_s for item in worst if item.ftti_s is not None]
    nearest = min(tolerated, default=0.0)
    reach = max(handled, min(max(tolerated, default=0.0), _WIDEST * max(handled, nearest)))
    return reach or 1.0


def _bar(group: FaultGroup, end: float) -> Bar:
    worst = group.worst

    def at(seconds: float) -> float:
        return 100.0 * seconds / end

    fdti = frti = open_from = None
    if worst.fdti_s is None:
        open_from = 0.0
    else:
        fdti = Span(0.0, max(_LEAST, at(worst.fdti_s)))
        if worst.fhti_s is None:
            open_from = fdti.width
        else:
            frti = Span(fdti.width, max(0.0, at(worst.fhti_s) - fdti.width))
    # What does no harm need not be handled.
    is_open = open_from is not None and worst.class_ != "masked"
    ftti = worst.ftti_s
    return Bar(
        group=group,
        fdti=fdti,
        frti=frti,
        open_from=open_from if is_open else None,
        ftti=None if ftti is None else min(100.0, at(ftti)),
        is_cut=ftti is not None and ftti > end,
        is_late=worst.class_ in {"detected_late", "undetected_violation"},
        text=_times(group),
    )


def _times(group: FaultGroup) -> str:
    worst = group.worst
    named = (("FDTI", worst.fdti_s), ("FRTI", worst.frti_s), ("FHTI", worst.fhti_s))
    known = [f"{name} {quantity(value, 's')}" for name, value in named if value is not None]
    if worst.fdti_s is None:
        known.append("not detected")
    elif worst.fhti_s is None:
        known.append("not handled")
    ftti = "none in the run" if worst.ftti_s is None else quantity(worst.ftti_s, "s")
    return ", ".join([*known, f"FTTI {ftti}"])


@dataclass(frozen=True, slots=True)
class TradeDot:
    """One value of the axis.

    Attributes:
        median: To the right, of the median FDTI; None where no fault was detected.
        worst: To the right, of the largest.
        y: Downwards, of the trips.
        low: Downwards, of the lower end of their interval; None without one.
        high: Of the upper end.
        label: The value of the axis; None where no room is left.
        title: What it says when it is pointed at.
    """

    median: float
    worst: float
    y: float
    low: float | None
    high: float | None
    label: Label | None
    title: str


@dataclass(frozen=True, slots=True)
class TradePicture:
    """The picture of a trade.

    Attributes:
        curve: What is drawn.
        dots: Its points that have a place.
        line: Points of the line along the medians.
        columns: Ticks of the FDTI.
        rows: Ticks of the trips.
        placeless: Values without a place: no fault was detected, or nothing was driven without.
    """

    curve: TradeCurve
    dots: tuple[TradeDot, ...]
    line: str
    columns: tuple[Tick, ...]
    rows: tuple[Tick, ...]
    placeless: tuple[str, ...]


def draw_trade(curve: TradeCurve) -> TradePicture | None:
    """Place the points of a curve; None if fewer than two have a place."""
    known = [
        (point, point.median_fdti_s, point.worst_fdti_s, point.calm.per_hour)
        for point in curve.points
    ]
    placed = [
        (point, median, worst, rate)
        for point, median, worst, rate in known
        if median is not None and worst is not None and rate is not None
    ]
    if len(placed) < 2:
        return None
    columns = ticks(0.0, max(worst for _, _, worst, _ in placed))
    highest = [rate if point.calm.high is None else point.calm.high for point, _, _, rate in placed]
    rows = ticks(0.0, max(highest))

    def right(seconds: float) -> float:
        return place(seconds, columns, _LEFT, WIDTH - _RIGHT)

    def down(rate: float) -> float:
        return place(rate, rows, HEIGHT - _BOTTOM, _TOP)

    places = [(right(median), down(rate)) for _, median, _, rate in placed]
    area = Box(_LEFT + 4.0, 2.0, WIDTH - 2.0, HEIGHT - _BOTTOM)
    spans = [
        Box(right(median), down(rate), right(worst), down(rate))
        for _, median, worst, rate in placed
    ]
    labels = place_labels([point.value for point, *_ in placed], places, area, spans)
    dots = tuple(
        TradeDot(
            median=right(median),
            worst=right(worst),
            y=down(rate),
            low=None if point.calm.low is None else down(point.calm.low),
            high=None if point.calm.high is None else down(point.calm.high),
            label=label,
            title=f"{curve.title} {point.value}: {number(rate)} trips per hour without a fault, "
            f"FDTI {quantity(median, 's')} (median), {quantity(worst, 's')} (worst), "
            f"{point.detected} of {point.faulty} detected",
        )
        for (point, median, worst, rate), label in zip(placed, labels, strict=True)
    )
    with_place = {point.value for point, *_ in placed}
    return TradePicture(
        curve=curve,
        dots=dots,
        line=" ".join(f"{x:.1f},{y:.1f}" for x, y in places),
        columns=tuple(Tick(right(mark), f"{mark:g}") for mark in columns),
        rows=tuple(Tick(down(mark), f"{mark:,g}") for mark in rows),
        placeless=tuple(item.value for item in curve.points if item.value not in with_place),
    )
