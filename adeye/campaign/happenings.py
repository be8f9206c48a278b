"""What happened in a run, as a list of events in order of time, read from its trace."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.signals import NO_CHANNEL, REASON_LABELS, STATUS_LABELS, Bools
from adeye.store.rows import EventRecord

if TYPE_CHECKING:
    from collections.abc import Iterator

    from adeye.trace import Trace


def events_of(trace: Trace, run: int) -> tuple[EventRecord, ...]:
    """List the events of a run.

    Args:
        trace: A batch.
        run: Row of the batch.

    Returns:
        Storyboard events, faults, channel states, monitors, handovers and contact.
    """
    found = [
        *_storyboard(trace, run),
        *_faults(trace, run),
        *_channels(trace, run),
        *_monitors(trace, run),
        *_handovers(trace, run),
        *_contact(trace, run),
    ]
    return tuple(sorted(found, key=lambda event: (event.time_s, event.kind, event.subject or "")))


def _decided(trace: Trace, run: int) -> int:
    """Number of rows with a decision: all but the last."""
    return max(0, int(trace.length[run]) - 1)


def _storyboard(trace: Trace, run: int) -> Iterator[EventRecord]:
    last = int(trace.length[run]) - 1
    for index, name in enumerate(trace.layout.context.event_ids):
        time = float(trace["begun"][run, last, index])
        if np.isfinite(time):
            yield EventRecord(time, "storyboard", name, f"{name} begins")


def _edges(values: Bools) -> Iterator[tuple[int, bool]]:
    """Rows at which a boolean changes, with what it changes to; it is false before row 0."""
    before = False
    for row in np.flatnonzero(np.diff(np.concatenate(([False], values)).astype(np.int8))):
        before = bool(values[row])
        yield int(row), before


def _faults(trace: Trace, run: int) -> Iterator[EventRecord]:
    rows = _decided(trace, run)
    for index, name in enumerate(trace.layout.faults):
        active = np.asarray(trace["fault_active"][run, :rows, index], dtype=np.bool_)
        for row, is_on in _edges(active):
            text = f"fault {name} {'begins' if is_on else 'ends'}"
            yield EventRecord(float(trace.time[row]), "fault", name, text)


def _channels(trace: Trace, run: int) -> Iterator[EventRecord]:
    rows = _decided(trace, run)
    for index, name in enumerate(trace.layout.channels):
        status = trace["status"][run, :rows, index]
        for row in range(1, rows):
            if status[row] != status[row - 1]:
                text = f"channel {name}: {STATUS_LABELS[int(status[row])]}"
                yield EventRecord(float(trace.time[row]), "channel", name, text)
    event = trace.channel_events[run]
    if event is not None:
        text = f"{event.outcome}: {event.detail}"
        yield EventRecord(event.time, "channel", event.channel, text)


def _monitors(trace: Trace, run: int) -> Iterator[EventRecord]:
    rows = _decided(trace, run)
    for index, name in enumerate(trace.layout.monitors):
        confirmed = np.asarray(trace["monitors"][run, :rows, index, 1], dtype=np.bool_)
        for row, is_on in _edges(confirmed):
            text = f"monitor {name} {'confirmed' if is_on else 'healed'}"
            yield EventRecord(float(trace.time[row]), "monitor", name, text)


def _handovers(trace: Trace, run: int) -> Iterator[EventRecord]:
    rows = _decided(trace, run)
    authority, reason = trace["authority"][run], trace["reason"][run]
    for row in range(1, rows):
        if authority[row] != authority[row - 1]:
            channel = int(authority[row])
            name = trace.layout.channels[channel] if channel != NO_CHANNEL else "none"
            text = f"authority to {name} ({REASON_LABELS[int(reason[row])]})"
            yield EventRecord(float(trace.time[row]), "switch", name, text)


def _contact(trace: Trace, run: int) -> Iterator[EventRecord]:
    last = int(trace.length[run]) - 1
    thing = int(trace["contact"][run, last])
    if thing >= 0:
        name = trace.layout.context.object_ids[thing]
        speed = float(trace["impact_speed"][run, last])
        text = f"contact with {name} at {speed:.2f} m/s"
        yield EventRecord(float(trace.time[last]), "contact", name, text)
