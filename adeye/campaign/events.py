"""What happened in the runs of a batch, as events in order of time, read from their trace."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.judge.metrics.perception import measuring_sensors
from adeye.signals import (
    NO_CHANNEL,
    OBJECT_HEADING,
    OBJECT_SPEED,
    PLACE_D,
    PLACE_HEADING,
    PLACE_OFFSET,
    REASON_HANDOVER,
    REASON_LABELS,
    STATUS_LABELS,
)
from adeye.store.block import EventBlock
from adeye.store.encoding import Dictionary, Texts
from adeye.store.rules import BEGINS, IDLE

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from adeye.signals import Bools, Floats, Ints
    from adeye.trace import Moved, Trace

_NO_CHANGE: Final = 1e-6
"""Of a speed [m/s] and a lateral place [m]: below it lies rounding."""
_KINDS = ("channel", "contact", "fault", "monitor", "sensor", "storyboard", "switch")


@dataclass
class _Found:
    """Events as they are found: parts with codes of kind, subject and text."""

    runs: list[Ints] = field(default_factory=list)
    times: list[Floats] = field(default_factory=list)
    codes: list[tuple[int, int, int]] = field(default_factory=list)
    names: dict[str, int] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)

    def add(self, kind: str, subject: str, text: str, runs: Ints, times: Floats) -> None:
        """Add events that differ in run and time only."""
        if not len(runs):
            return
        self.runs.append(np.asarray(runs, dtype=np.int64))
        self.times.append(np.asarray(times, dtype=np.float64))
        name = self.names.setdefault(subject, len(self.names))
        line = self.lines.setdefault(text, len(self.lines))
        self.codes.append((_KINDS.index(kind), name, line))

    def block(self) -> EventBlock:
        """Sort by run, time, kind and subject; what is found first stays first."""
        names = tuple(self.names)
        order = {name: place for place, name in enumerate(sorted(names))}
        rank = np.array([order[name] for name in names], dtype=np.int64)
        codes = np.array(self.codes, dtype=np.int64).reshape(-1, 3)
        counts = np.array([len(part) for part in self.runs], dtype=np.int64)
        kind, subject, text = np.repeat(codes, counts, axis=0).T
        run = np.concatenate([np.zeros(0, dtype=np.int64), *self.runs])
        time = np.concatenate([np.zeros(0), *self.times])
        chosen = np.lexsort((rank[subject], kind, time, run))
        return EventBlock(
            run[chosen],
            time[chosen],
            Texts(kind[chosen], Dictionary(_KINDS)),
            Texts(subject[chosen], Dictionary(names)),
            Texts(text[chosen], Dictionary(tuple(self.lines))),
        )


def happenings(trace: Trace, critical: Ints | None = None) -> EventBlock:
    """List the events of every run of a batch.

    Args:
        trace: The batch.
        critical: (B,) object whose first detection by each sensor is an event; -1 for none.

    Returns:
        Storyboard events, faults, channel states, monitors, handovers, contact and first
        detections.
    """
    found = _Found()
    # Nothing is decided at the last row of a run.
    decided = np.arange(trace.time.shape[0]) < (trace.length - 1)[:, np.newaxis]
    _storyboard(trace, found)
    for name, active in _flags(trace, trace.layout.faults, trace["fault_active"]):
        _edges(trace, found, ("fault", f"fault {name}", name), ("begins", "ends"), active, decided)
    _channels(trace, found, decided)
    confirmed = trace["monitors"][..., 1]
    for name, active in _flags(trace, trace.layout.monitors, confirmed):
        words = ("confirmed", "healed")
        _edges(trace, found, ("monitor", f"monitor {name}", name), words, active, decided)
    _handovers(trace, found, decided)
    _contact(trace, found)
    if critical is not None:
        _detections(trace, found, critical)
    return found.block()


def _storyboard(trace: Trace, found: _Found) -> None:
    begun: Floats = trace["begun"][np.arange(trace.runs), trace.length - 1].astype(np.float64)
    for index, name in enumerate(trace.layout.context.event_ids):
        runs = np.flatnonzero(np.isfinite(begun[:, index]))
        is_idle = _changes_nothing(trace, begun, index)[runs]
        for chosen, text in ((runs[~is_idle], name + BEGINS), (runs[is_idle], name + IDLE)):
            found.add("storyboard", name, text, chosen, begun[chosen, index])
        lost = np.flatnonzero(np.isinf(begun[:, index]))
        times = trace.time[np.isinf(trace["begun"][lost, :, index]).argmax(axis=1)]
        text = f"{name} is lost: a later event takes its place at the same time"
        found.add("storyboard", name, text, lost, times)


def _changes_nothing(trace: Trace, begun: Floats, index: int) -> Bools:
    """Tell in which runs (B,) an event leaves what it is about as it was.

    That is its actor's speed along the road and its lateral place across it. It has time until
    another event of the actor about the same begins, or the run ends; without a row for it nothing
    is known.

    Args:
        trace: The batch.
        begun: (B, E) when each event began [s]; NaN where it did not, inf where it was lost.
        index: Of the event.
    """
    if not trace.layout.moved:
        return np.zeros(trace.runs, dtype=np.bool_)
    moved = trace.layout.moved[index]
    has_begun = np.isfinite(begun[:, index])
    since = np.where(has_begun, begun[:, index], 0.0)[:, np.newaxis]
    # Another one of the actor may end it; NaN compares false, and inf is no end.
    others = begun[:, [_meets(moved, other) for other in trace.layout.moved]]
    ends = trace.time[trace.length - 1]
    until = np.where(others > since, others, np.inf).min(axis=1, initial=np.inf)
    until = np.minimum(until, ends)[:, np.newaxis]
    first, last = (np.rint(time / trace.layout.context.step) for time in (since, until))
    rows = np.arange(trace.time.shape[0])
    own = (rows >= first) & (rows <= last)
    is_idle = has_begun & (last > first)[:, 0]

    def of(column: str, quantity: int) -> Floats:
        return trace[column][:, :, moved.object, quantity].astype(np.float64)

    def keeps(values: Floats) -> Bools:
        most = np.where(own, values, -np.inf).max(axis=1)
        least = np.where(own, values, np.inf).min(axis=1)
        return np.asarray(most - least <= _NO_CHANGE)

    if moved.along:
        speed = of("objects", OBJECT_SPEED)
        # Who changes lane meanwhile is faster than along the road.
        turned = of("objects", OBJECT_HEADING) - of("object_places", PLACE_HEADING)
        is_idle &= keeps(speed) | keeps(speed * np.cos(turned))
    if moved.across:
        # Who keeps to a lane that shifts is carried along.
        is_idle &= keeps(of("object_places", PLACE_D)) | keeps(of("object_places", PLACE_OFFSET))
    return is_idle


def _meets(one: Moved, other: Moved) -> bool:
    """Tell whether two events are about the same of one actor."""
    is_about_same = (one.along and other.along) or (one.across and other.across)
    return one.object == other.object and is_about_same


def _flags(
    trace: Trace, names: tuple[str, ...], column: np.ndarray[tuple[int, ...], np.dtype[np.generic]]
) -> Iterable[tuple[str, Bools]]:
    return ((name, column[:, :, index] != 0) for index, name in enumerate(names) if trace.runs)


def _edges(
    trace: Trace,
    found: _Found,
    what: tuple[str, str, str],
    words: tuple[str, str],
    active: Bools,
    decided: Bools,
) -> None:
    """Find where a truth value changes; it is false before row 0."""
    kind, title, name = what
    if not active.any():
        return
    changed = active & decided
    changed[:, 1:] &= ~active[:, :-1]
    ended = decided[:, 1:] & active[:, :-1] & ~active[:, 1:]
    # In order of time, so that events of one time come as they did.
    runs, rows = np.nonzero(changed)
    found.add(kind, name, f"{title} {words[0]}", runs, trace.time[rows])
    runs, rows = np.nonzero(ended)
    found.add(kind, name, f"{title} {words[1]}", runs, trace.time[rows + 1])


def _changes(column: NDArray[Any], decided: Bools) -> tuple[Ints, Ints]:
    """Find runs and rows at which a code differs from the row before."""
    runs, rows = np.nonzero((column[:, 1:] != column[:, :-1]) & decided[:, 1:])
    return runs, rows + 1


def _channels(trace: Trace, found: _Found, decided: Bools) -> None:
    for index, name in enumerate(trace.layout.channels):
        status = trace["status"][:, :, index]
        runs, rows = _changes(status, decided)
        codes = status[runs, rows]
        for code in np.unique(codes):
            text = f"channel {name}: {STATUS_LABELS[int(code)]}"
            chosen = codes == code
            found.add("channel", name, text, runs[chosen], trace.time[rows[chosen]])
    for run, event in enumerate(trace.channel_events):
        for failure in () if event is None else (event, *event.later):
            text = f"{failure.outcome}: {failure.detail}"
            found.add("channel", failure.channel, text, np.array([run]), np.array([failure.time]))


def _handovers(trace: Trace, found: _Found, decided: Bools) -> None:
    """Find who has authority after whom and why, and when a handover with a latency begins."""
    authority, reason = trace["authority"], trace["reason"]
    names = (*trace.layout.channels, "none")  # NO_CHANNEL counts from the end
    assert NO_CHANNEL == -1
    runs, rows = _changes(authority, decided)
    changes = np.stack([authority[runs, rows], authority[runs, rows - 1], reason[runs, rows]])
    for change in sorted(set(map(tuple, changes.T.tolist()))):
        to, before, why = change
        chosen = (changes == np.array(change)[:, np.newaxis]).all(axis=0)
        text = f"authority to {names[to]} from {names[before]} ({REASON_LABELS[why]})"
        found.add("switch", names[to], text, runs[chosen], trace.time[rows[chosen]])
    # Where the old channel acts meanwhile, authority does not tell that another is to come.
    runs, rows = _changes(reason, decided)
    begins = (reason[runs, rows] == REASON_HANDOVER) & (
        authority[runs, rows] == authority[runs, rows - 1]
    )
    runs, rows = runs[begins], rows[begins]
    for channel in np.unique(authority[runs, rows]).tolist():
        chosen = authority[runs, rows] == channel
        text = f"handover from {names[channel]} begins"
        found.add("switch", names[channel], text, runs[chosen], trace.time[rows[chosen]])


def _contact(trace: Trace, found: _Found) -> None:
    last = trace.length - 1
    touched = trace["contact"][np.arange(trace.runs), last]
    for run in np.flatnonzero(touched >= 0):
        name = trace.layout.context.object_ids[int(touched[run])]
        speed = float(trace["impact_speed"][run, last[run]])
        text = f"contact with {name} at {speed:.2f} m/s"
        found.add("contact", name, text, np.array([run]), trace.time[last[run : run + 1]])


def _detections(trace: Trace, found: _Found, critical: Ints) -> None:
    """Find when each sensor that feeds a channel first detects the critical object."""
    in_run = np.arange(trace.time.shape[0]) < trace.length[:, np.newaxis]
    for item in np.unique(critical[critical >= 0]).tolist():
        runs = np.flatnonzero(critical == item)
        name = trace.layout.context.object_ids[item]
        for index in measuring_sensors(trace.layout):
            sensor = trace.layout.sensors[index]
            seen = (trace["detected"][runs, :, index, item] != 0) & in_run[runs]
            has_seen = seen.any(axis=1)
            times = trace.time[seen.argmax(axis=1)[has_seen]]
            found.add("sensor", sensor, f"{sensor} first detects {name}", runs[has_seen], times)
