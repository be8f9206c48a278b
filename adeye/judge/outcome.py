"""What happened to a run: how it ended, whether it came about as asked, whether a channel failed.

None of it says anything about an FSR, but it decides whether and how far an FSR can be judged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, get_args

import numpy as np

from adeye.judge.verdict import Outcome
from adeye.kernel.motion import GRAVITY
from adeye.kernel.road import mark_in_refuge, mark_on_road
from adeye.signals import PLACE_D, PLACE_HEADING, PLACE_LANE, PLACE_S

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats, Ints, RoadMap, SceneContext
    from adeye.trace import Trace

# --- What happened to a run: how it ended, whether it came about as asked, whether a channel
# failed.

EndReason = Literal["contact", "goal", "horizon", "road_end"]
END_REASONS: Final[tuple[EndReason, ...]] = get_args(EndReason)
OUTCOMES: Final = tuple(Outcome)

UNTESTED: Final = "not tested: "
"""Begins the reason of a run that is no evidence for what holds, but is for what fails."""

_COMPLETED = OUTCOMES.index(Outcome.COMPLETED)
_NOT_REALISED = OUTCOMES.index(Outcome.NOT_REALISED)


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


@dataclass(frozen=True, slots=True)
class OutcomeColumns:
    """What happened to B runs.

    Attributes:
        code: (B,) index into ``OUTCOMES``.
        channels: Channel that failed, by run; absent where none did.
        details: Why, in words, by run; absent where there is nothing to say.
        realised: (B,) whether the scenario came about as asked.
        end_reason: (B,) index into ``END_REASONS``.
    """

    code: Ints
    channels: dict[int, str]
    details: dict[int, str]
    realised: Bools
    end_reason: Ints

    def run(self, run: int) -> RunOutcome:
        """Say what happened to one run."""
        return RunOutcome(
            OUTCOMES[self.code[run]],
            self.channels.get(run),
            self.details.get(run),
            bool(self.realised[run]),
            END_REASONS[self.end_reason[run]],
        )


def outcomes(trace: Trace) -> OutcomeColumns:
    """Say what happened to every run of a trace.

    A failing channel is named first, for it may be why the scenario did not come about.
    """
    missing, left = missing_events(trace), left_road(trace)
    cut_short = ended_by_contact(trace) | left
    # What had no time to act does not hide the contact, here as with events.
    idle = [() if cut else names for names, cut in zip(idle_faults(trace), cut_short, strict=True)]
    realised = np.array([not (a or b) for a, b in zip(missing, idle, strict=True)], dtype=np.bool_)
    realised &= ~left
    code = np.where(realised, _COMPLETED, _NOT_REALISED)
    channels: dict[int, str] = {}
    details = {
        run: _left_road(trace, run)
        if left[run]
        else _not_begun(missing[run])
        if missing[run]
        else _not_acted(idle[run])
        for run in np.flatnonzero(~realised).tolist()
    }
    for run, event in enumerate(trace.channel_events):
        if event is not None:
            code[run] = OUTCOMES.index(Outcome(event.outcome))
            channels[run] = event.channel
            details[run] = f"at {event.time:g} s: {event.detail}"
    goal = np.where(trace.horizon_row < full_horizon_row(trace), 1, 2)
    cut = np.where(left, END_REASONS.index("road_end"), END_REASONS.index("contact"))
    return OutcomeColumns(code, channels, details, realised, np.where(trace.complete, goal, cut))


def full_horizon_row(trace: Trace) -> int:
    """Return the row of the scenario's horizon."""
    return round(trace.layout.horizon / trace.layout.context.step)


def at_goal(trace: Trace) -> Bools:
    """Tell at which rows (B, T) the ego has arrived at its goal, in a lane of its way."""
    # A contact, or the end of the road, ends it, too: at the last row or the one before.
    latest = np.where(trace.complete, full_horizon_row(trace), last_rows(trace) - 1)
    arrived, rows = trace.horizon_row[:, np.newaxis], np.arange(trace["ego_place"].shape[1])
    # Who passes it beside the road has missed it, though the horizon ends there as well.
    lanes = np.take_along_axis(trace["ego_place"][..., PLACE_LANE], arrived, axis=1)
    is_there = (arrived < latest[:, np.newaxis]) & np.greater_equal(lanes, 0.0)
    return np.asarray(is_there & (rows >= arrived))


def last_rows(trace: Trace) -> Ints:
    """Return the last row (B,) of each run."""
    return np.asarray(trace.length - 1)


def ended_by_contact(trace: Trace) -> Bools:
    """Tell which runs (B,) ended because the ego touched something."""
    rows = np.arange(trace.runs)
    return np.asarray((trace["contact"][rows, last_rows(trace)] >= 0) & ~trace.complete)


def left_road(trace: Trace) -> Bools:
    """Tell which runs (B,) ended because the ego drove over the begin or the end of the road."""
    rows = np.arange(trace.runs)
    # A trace of no rows, as of a plan, has left nothing.
    s = np.asarray(trace["ego_place"][rows, last_rows(trace), PLACE_S])
    return ~trace.layout.context.road.covers(s) & ~trace.complete & ~ended_by_contact(trace)


def obligation_rows(trace: Trace) -> Ints:
    """Return the last row (B,) at which an obligation of a formula may start.

    It is the row of horizon or goal, or the last one on the road. A contact up to then does not
    bring it forward: obligations that had no time to start are open. After a contact in the tail it
    is the row of the contact, so that no contact is beyond what is judged.
    """
    last = last_rows(trace)
    cut_short = np.where(trace.horizon_row < last, last, full_horizon_row(trace))
    is_known = trace.complete | left_road(trace)
    return np.where(is_known, trace.horizon_row, np.maximum(cut_short, last))


def missing_events(trace: Trace) -> tuple[tuple[str, ...], ...]:
    """List for each run the storyboard events that should have begun before the horizon.

    What begins at its last row shows in none at which an obligation starts. A run that ended by
    contact has none: what had no time to begin does not hide the contact. The end of the road has
    its own reason.
    """
    layout = trace.layout
    events = [layout.context.event_ids.index(name) for name in layout.realised]
    last = last_rows(trace)
    begun = trace["begun"][np.arange(trace.runs), last][:, events]
    limit = trace.time[np.minimum(trace.horizon_row, last)][:, np.newaxis]
    # NaN compares false: what has never begun has not begun in time.
    has_begun = (begun < limit) | (ended_by_contact(trace) | left_road(trace))[:, np.newaxis]
    missing: list[tuple[str, ...]] = [()] * trace.runs
    for run in np.flatnonzero(~has_begun.all(axis=1)):
        names = zip(layout.realised, has_begun[run], strict=True)
        missing[run] = tuple(name for name, fine in names if not fine)
    return tuple(missing)


def idle_faults(trace: Trace) -> tuple[tuple[str, ...], ...]:
    """List for each run the planned faults that were never present within the horizon.

    Obligations begin within the horizon, so that what comes later tests nothing.
    """
    rows = np.arange(trace.time.shape[0])
    # Nothing is decided at the last row of a run, so no fault is present there.
    counted = rows <= np.minimum(trace.horizon_row, last_rows(trace) - 1)[:, np.newaxis]
    has_acted = ((trace["fault_active"] != 0) & counted[:, :, np.newaxis]).any(axis=1)
    idle: list[tuple[str, ...]] = [()] * trace.runs
    for run in np.flatnonzero(~has_acted.all(axis=1)):
        names = zip(trace.layout.faults, has_acted[run], strict=True)
        idle[run] = tuple(name for name, acted in names if not acted)
    return tuple(idle)


def bars(reason: str | None) -> bool:
    """Tell whether a reason of ``invalid_reasons`` bars every verdict, that of a FAIL, too."""
    return reason is not None and not reason.startswith(UNTESTED)


def invalid_reasons(trace: Trace) -> tuple[str | None, ...]:
    """Say for each run why FSRs cannot be judged on it, None where they can.

    A run whose planned fault never acted shows nothing about handling it, nor does one that ran out
    of road about what was to come: the reason begins with ``UNTESTED``, and what fails in it fails
    nevertheless.
    """
    rows = np.arange(trace.time.shape[0])
    known = rows < trace.length[:, np.newaxis]
    never = trace.time.shape[0]
    touched = _first(known & (trace["contact"] >= 0), never)
    foreign = _first(known & (trace["foreign_contact"] != 0), never)
    missing = missing_events(trace)
    reasons: list[str | None] = [
        f"{UNTESTED}{_not_acted(names)}" if names else None for names in idle_faults(trace)
    ]
    for off in np.flatnonzero(left_road(trace)).tolist():
        reasons[off] = f"{UNTESTED}{_left_road(trace, off)}"
    is_realised = np.array([not names for names in missing], dtype=np.bool_)
    for run in np.flatnonzero((touched == 0) | (foreign < touched) | ~is_realised):
        if touched[run] == 0:
            reasons[run] = "the ego touches an object from the start"
        elif foreign[run] < touched[run]:
            at = trace.time[foreign[run]]
            reasons[run] = f"other traffic collided first, at {at:g} s"
        else:
            reasons[run] = f"not realised: {_not_begun(missing[run])}"
    return tuple(reasons)


def _left_road(trace: Trace, run: int) -> str:
    road, last = trace.layout.context.road, int(last_rows(trace)[run])
    edge = "begin" if trace["ego_place"][run, last, PLACE_S] < 0.0 else "end"
    length = f"{road.length[run]:g} m"
    return f"the ego drove over the {edge} of the road of {length} at {trace.time[last]:g} s"


def _not_begun(events: tuple[str, ...]) -> str:
    return f"{', '.join(events)} did not begin within the horizon"


def _not_acted(faults: tuple[str, ...]) -> str:
    return f"fault {', '.join(faults)} did not act within the horizon"


def _first(flags: Bools, never: int) -> Ints:
    return np.where(flags.any(axis=1), flags.argmax(axis=1), never)


# --- Which places of a trace are on the road, and in a parking bay or rest area -------------------


def on_road(road: RoadMap, places: Floats) -> Bools:
    """Tell which places are on a lane, the shoulder, a parking bay, rest area or free verge.

    Before the begin of the road and behind its end there is none.

    Args:
        road: Of B runs.
        places: (B, T, 6), see ``signals.PLACE_COLUMNS``; what is no number is not on the road.
    """
    # The same layout as where a start is placed: the kernel is compiled once.
    s, d = (np.ascontiguousarray(places[..., axis]) for axis in (PLACE_S, PLACE_D))
    marks: Bools = mark_on_road(road.grounds(), 0.0, s, d)
    return np.asarray(marks & road.covers(s))


def in_refuge(context: SceneContext, places: Floats, headings: Floats) -> Bools:
    """Tell where the body of the ego is wholly in a parking bay or rest area.

    Args:
        context: Road and size of the ego of B runs.
        places: (B, T, 6) of its centre, see ``signals.PLACE_COLUMNS``.
        headings: (B, T) in the map [rad].
    """
    road, align = context.road, headings - places[..., PLACE_HEADING]
    s, d = places[..., PLACE_S], places[..., PLACE_D]
    marks: Bools = mark_in_refuge(road.grounds(), context.ego_size, s, d, align)
    return marks


# --- What the ego of each run is able to do on its road -------------------------------------------


def abilities(trace: Trace) -> Floats:
    """Give the largest braking, lateral acceleration and acceleration (B, 3) of the egos [m/s²].

    Braking and acceleration are those of the vehicle, and all three no more than friction allows.
    """
    grip = trace.layout.context.surroundings.friction * GRAVITY
    vehicles = [item.vehicle for item in trace.layout.architectures]
    braking = np.array([vehicle.max_deceleration for vehicle in vehicles])
    acceleration = np.array([vehicle.max_acceleration for vehicle in vehicles])
    return np.stack([np.minimum(braking, grip), grip, np.minimum(acceleration, grip)], axis=1)
