"""What happened to a run: how it ended, whether it came about as asked, whether a channel failed.

None of it says anything about an FSR, but it decides whether and how far an FSR can be judged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from adeye.evaluation.verdict import Outcome

if TYPE_CHECKING:
    from adeye.signals import Bools, Ints
    from adeye.trace import Trace

EndReason = Literal["contact", "goal", "horizon"]


@dataclass(frozen=True, slots=True)
class RunOutcome:
    """What happened to one run.

    Attributes:
        outcome: The first failure of a channel, else whether the scenario came about.
        channel: Channel that failed.
        detail: Why, in words.
        is_realised: Whether the scenario came about as asked.
        end_reason: What ended the run.
    """

    outcome: Outcome
    channel: str | None
    detail: str | None
    is_realised: bool
    end_reason: EndReason


def outcome(trace: Trace, run: int) -> RunOutcome:
    """Say what happened to a run.

    A failing channel is named first, for it may be why the scenario did not come about.

    Args:
        trace: The runs.
        run: Number of the run.
    """
    missing = missing_events(trace)[run]
    event = trace.channel_events[run]
    kind, channel, detail = Outcome.COMPLETED, None, None
    if event is not None:
        kind, channel = Outcome(event.outcome), event.channel
        detail = f"at {event.time:g} s: {event.detail}"
    elif missing:
        kind = Outcome.NOT_REALISED
        detail = f"{', '.join(missing)} did not begin within the horizon"
    return RunOutcome(kind, channel, detail, not missing, _end_reason(trace, run))


def full_horizon_row(trace: Trace) -> int:
    """Return the row of the scenario's horizon."""
    return round(trace.layout.horizon / trace.layout.context.step)


def last_rows(trace: Trace) -> Ints:
    """Return the last row (B,) of each run."""
    return np.asarray(trace.length - 1)


def ended_by_contact(trace: Trace) -> Bools:
    """Tell which runs (B,) ended because the ego touched something."""
    rows = np.arange(trace.runs)
    return np.asarray((trace["contact"][rows, last_rows(trace)] >= 0) & ~trace.complete)


def obligation_rows(trace: Trace) -> Ints:
    """Return the last row (B,) at which an obligation of a formula may start.

    It is the row of horizon or goal. A contact up to then does not bring it forward: obligations
    that had no time to start are open. After a contact in the tail it is the row of the contact, so
    that no contact is beyond what is judged.
    """
    last = last_rows(trace)
    cut_short = np.where(trace.horizon_row < last, last, full_horizon_row(trace))
    return np.where(trace.complete, trace.horizon_row, np.maximum(cut_short, last))


def missing_events(trace: Trace) -> tuple[tuple[str, ...], ...]:
    """List for each run the storyboard events that should have begun within the horizon.

    A run that ended by contact has none: what had no time to begin does not hide the contact.
    """
    layout = trace.layout
    events = [layout.context.event_ids.index(name) for name in layout.realised]
    last = last_rows(trace)
    begun = trace["begun"][np.arange(trace.runs), last][:, events]
    limit = trace.time[np.minimum(trace.horizon_row, last)][:, np.newaxis]
    # NaN compares false: what has never begun has not begun in time.
    has_begun = (begun <= limit) | ended_by_contact(trace)[:, np.newaxis]
    return tuple(
        tuple(name for name, fine in zip(layout.realised, row, strict=True) if not fine)
        for row in has_begun
    )


def invalid_reasons(trace: Trace) -> tuple[str | None, ...]:
    """Say for each run why no FSR can be judged on it, None where they can."""
    rows = np.arange(trace.time.shape[0])
    known = rows < trace.length[:, np.newaxis]
    never = trace.time.shape[0]
    touched = _first(known & (trace["contact"] >= 0), never)
    foreign = _first(known & (trace["foreign_contact"] != 0), never)
    reasons: list[str | None] = []
    for run, missing in enumerate(missing_events(trace)):
        reason = None
        if touched[run] == 0:
            reason = "the ego touches an object from the start"
        elif foreign[run] < touched[run]:
            at = trace.time[foreign[run]]
            reason = f"other traffic collided first, at {at:g} s"
        elif missing:
            reason = f"not realised: {', '.join(missing)} did not begin within the horizon"
        reasons.append(reason)
    return tuple(reasons)


def _first(flags: Bools, never: int) -> Ints:
    return np.where(flags.any(axis=1), flags.argmax(axis=1), never)


def _end_reason(trace: Trace, run: int) -> EndReason:
    if not trace.complete[run]:
        return "contact"
    return "goal" if trace.horizon_row[run] < full_horizon_row(trace) else "horizon"
