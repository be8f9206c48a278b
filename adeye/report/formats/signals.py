"""Signals of a run drawn over time, one strip below the other, as a picture in SVG."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Final

from adeye.report.page.charts import Tick, place, ticks
from adeye.report.templates import xml_file, xml_of
from adeye.report.words import number, quantity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.report.page.replay import SignalPlot, ThresholdLine

WIDTH: Final = 840.0
STRIP: Final = 130.0
"""Height of the strip of one signal."""
LEFT, RIGHT, HEAD, FOOT = 150.0, 20.0, 34.0, 34.0
_TOP, _BOTTOM = 26.0, 8.0
"""What stands above and below the curve in its strip."""
_MOST_WORDS: Final = 3
_SIDES: Final = {"at_least": "≥", "at_most": "≤"}
_BESIDE: Final = 1.0 / 3.0
"""Part of the height that a threshold may add to what is shown of a curve."""


@dataclass(frozen=True, slots=True)
class Drawing:
    """What is drawn of a run.

    Attributes:
        title: Line above it.
        time_s: (T,) times of the rows [s].
        plots: Signals, each with T values.
        events: Time [s] and text of what happened.
    """

    title: str
    time_s: tuple[float, ...]
    plots: tuple[SignalPlot, ...]
    events: tuple[tuple[float, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Limit:
    """A threshold of an FSR in the strip, or what it is that lies beyond it."""

    y: float | None
    text: str


@dataclass(frozen=True, slots=True)
class Strip:
    """The curve of one signal.

    Attributes:
        top: Where it begins.
        name: With its unit, and the range of its values.
        lines: Points of each part without a gap.
        dots: Places of samples that stand alone.
        rows: Ticks of the values.
        limits: Thresholds of FSRs.
    """

    top: float
    name: str
    lines: tuple[str, ...]
    dots: tuple[tuple[float, float], ...]
    rows: tuple[Tick, ...]
    limits: tuple[Limit, ...]


def draw_signals(drawing: Drawing) -> bytes:
    """Draw signals over time: an SVG file."""
    marks = ticks(drawing.time_s[0], drawing.time_s[-1])

    def right(time: float) -> float:
        return place(time, marks, LEFT, WIDTH - RIGHT)

    columns = [right(time) for time in drawing.time_s]
    plots = map(_with_few_words, drawing.plots)
    strips = [_strip(plot, columns, HEAD + STRIP * at) for at, plot in enumerate(plots)]
    root = xml_of(
        "signals.svg.j2",
        title=drawing.title,
        strips=strips,
        columns=[Tick(right(mark), f"{mark:g}") for mark in marks],
        events=[(right(time), text) for time, text in drawing.events],
        width=WIDTH,
        height=HEAD + STRIP * len(strips) + FOOT,
        left=LEFT,
        right=WIDTH - RIGHT,
        head=HEAD,
    )
    return xml_file(root)


def _with_few_words(plot: SignalPlot) -> SignalPlot:
    """Leave out the words of an enumeration that do not occur, for which there is no room."""
    if len(plot.labels) <= _MOST_WORDS:
        return plot
    codes = sorted({value for value in plot.values if value is not None})
    return plot.model_copy(
        update={
            "labels": tuple(plot.labels[round(code)] for code in codes),
            "values": tuple(
                None if value is None else float(codes.index(value)) for value in plot.values
            ),
        }
    )


def _strip(plot: SignalPlot, columns: Sequence[float], top: float) -> Strip:
    known = [value for value in plot.values if value is not None]
    marks = marks_of(plot, known)
    low, high = top + STRIP - _BOTTOM, top + _TOP

    def down(value: float) -> float:
        # Beyond its cap a larger value says no more, and the axis ends there.
        return place(min(value, marks[-1]), marks, low, high)

    texts = plot.labels or [f"{mark:g}" for mark in marks]
    samples = list(zip(columns, plot.values, strict=True))
    parts = [
        [(x, down(value)) for x, value in part if value is not None]
        for is_known, part in groupby(samples, lambda sample: sample[1] is not None)
        if is_known
    ]
    lines = [_steps(part) if plot.labels else part for part in parts if len(part) > 1]
    return Strip(
        top=top,
        name=_name(plot, known),
        lines=tuple(" ".join(f"{x:.1f},{y:.1f}" for x, y in line) for line in lines),
        dots=tuple(part[0] for part in parts if len(part) == 1),
        rows=tuple(Tick(down(mark), text) for mark, text in zip(marks, texts, strict=False)),
        limits=tuple(
            Limit(
                down(line.value) if marks[0] <= line.value <= marks[-1] else None,
                limit_text(line, plot.unit),
            )
            for line in plot.thresholds
        ),
    )


def limit_text(line: ThresholdLine, unit: str) -> str:
    """Write what an FSR asks of a signal."""
    return f"{line.fsr} {_SIDES[line.side]} {quantity(line.value, unit)}"


def _name(plot: SignalPlot, known: Sequence[float]) -> str:
    named = f"{plot.name} [{plot.unit}]" if plot.unit else plot.name
    if not known:
        return f"{named}: no value"
    if plot.labels:
        return named
    return f"{named}: {number(min(known))} to {number(max(known))}"


def marks_of(plot: SignalPlot, known: Sequence[float]) -> list[float]:
    """Choose the values that the axis is marked with; thresholds are shown if they are near."""
    if plot.labels:
        # Of one word alone, the axis needs a second end.
        return [float(code) for code in range(max(2, len(plot.labels)))]
    shown = [min(value, plot.cap) for value in known] if plot.cap is not None else list(known)
    low, high = min(shown, default=0.0), max(shown, default=1.0)
    reach = _BESIDE * (high - low)
    limits = [item.value for item in plot.thresholds]
    near = [value for value in limits if low - reach <= value <= high + reach]
    return ticks(min([low, *near]), max([high, *near]))


def _steps(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Hold each value until the next one: between two words there is none."""
    corners = [points[0]]
    for x, y in points[1:]:
        corners += [(x, corners[-1][1]), (x, y)]
    return corners
