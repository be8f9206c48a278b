"""The supervised channel at one tick: ask the monitors, choose a manoeuvre, give a command."""

from __future__ import annotations

from typing import Final

from adeye.channels.perception import NOTE_END
from adeye.channels.pose import POSE_ACCELERATION, POSE_S
from adeye.channels.safety.kinds import (
    CHANNEL_IMPLAUSIBLE,
    CHANNEL_STUCK,
    LAST_SAFE_STOP,
    OBJECT_DANGER,
    RULE_KIND,
    RULE_LEVEL,
    SENSOR_SILENT,
    Watch,
    count,
    forget_changes,
    misses_pose,
    of_scene,
    of_watched,
    remember,
    steps_to_confirm,
)
from adeye.channels.safety.manoeuvres import (
    FORCE_ASKED,
    FORCE_HELD,
    FORCE_LEFT,
    FORCE_LEVEL,
    REST_AREA,
    ROADSIDE_PARKING,
    SET_EVERY,
    STOP,
    Force,
    ask,
    give_way,
    look_ahead,
    show_manoeuvre,
)
from adeye.channels.safety.monitors import STATE_CONFIRMED, STATE_FROZEN, STATE_RAW
from adeye.channels.safety.planner import FOUND_FEASIBLE, FOUND_PLACE, NO_STOP
from adeye.channels.safety.planning import (
    KEPT_STOP,
    Plans,
    ask_for_stop,
    drive_stop,
    foresee,
    is_last_stop,
    take_stop,
)
from adeye.channels.safety.supervision import (
    MEMORY_STOPPING,
    Batch,
    coast,
    perceive,
    shadow,
    stop_in_lane,
    update_stopping,
)
from adeye.kernel.jit import inlined
from adeye.kernel.refuge_stops import ANYWHERE, ONLY_REST_AREA, ROADSIDE
from adeye.kernel.stops import STOP_LEVELS
from adeye.signals import DEGRADED, OK

CHANNEL_KINDS: Final = SENSOR_SILENT
"""Kinds up to this one watch channels or sensors; the ones after it the scene."""

_UNHURRIED: Final = 1
"""Hardest level of the library of stops that brakes no harder than the stop deceleration."""


@inlined
def supervised_step(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    watch: Watch,
    force: Force,
    run: int,
    time: float,
    planned: bool,  # noqa: FBT001 - a kernel
    shows: bool,  # noqa: FBT001 - a kernel
) -> int:
    """Decide one run at one tick.

    Args:
        batch: What it reads and writes.
        plans: And of the stops.
        watch: And of the monitors.
        force: And of the manoeuvres.
        run: Which row is meant.
        time: [s].
        planned: Whether it plans its stops; without, it stops in its lane.
        shows: Whether somebody looks at the stops.

    Returns:
        OK; DEGRADED while a monitor is confirmed and the nominal channel is to go on;
        REQUESTS_AUTHORITY; or FAULT without a recent ego estimate.
    """
    state, memory, kept = force.state[run], batch.memory[run], plans.kept[run]
    knows_pose = perceive(batch, run, time)
    objects = foresee(batch, plans, run) if knows_pose and planned else 0
    remember(batch, watch, run, time, knows_pose)
    if state[FORCE_LEFT] <= 0.0:
        state[FORCE_LEFT] = force.settings[run, SET_EVERY]
        _ask_monitors(batch, plans, watch, force, run, time, objects, knows_pose)
    state[FORCE_LEFT] -= 1.0
    ask(state, force.settings[run], memory[MEMORY_STOPPING] > 0.0, batch.records[run]["period"])
    if not knows_pose:
        kept[KEPT_STOP] = NO_STOP
        show_manoeuvre(state, batch.monitors[run, watch.rules.shape[1] :])
        return coast(batch, run)
    _choose(batch, plans, force, run, objects, planned, shows)
    show_manoeuvre(state, batch.monitors[run, watch.rules.shape[1] :])
    if memory[MEMORY_STOPPING] <= 0.0:
        told = shadow(batch, run, False)  # noqa: FBT003 - a kernel
    else:
        requests = state[FORCE_ASKED] >= REST_AREA
        is_danger = _is_danger(batch, watch, run)
        if planned:
            told = drive_stop(batch, plans, run, requests, is_danger)
        else:
            told = stop_in_lane(batch, run, requests, is_danger)
    return DEGRADED if told == OK and state[FORCE_LEVEL] > 0.0 else told


@inlined
def _ask_monitors(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    watch: Watch,
    force: Force,
    run: int,
    time: float,
    objects: int,
    knows_pose: bool,  # noqa: FBT001 - a kernel
) -> None:
    """Ask every monitor, count, and find the highest level among the confirmed ones."""
    end, level = int(batch.notes[run, NOTE_END]), 0.0
    period = batch.records[run]["period"]
    for monitor in range(watch.rules.shape[1]):
        rule = watch.rules[run, monitor]
        kind = int(rule[RULE_KIND])
        asks_pose = kind in (CHANNEL_IMPLAUSIBLE, CHANNEL_STUCK) or kind > CHANNEL_KINDS
        fires = asks_pose and misses_pose(watch, run, time, knows_pose)
        if kind <= CHANNEL_KINDS:
            fires = fires or of_watched(batch, watch, run, monitor, time)
        elif knows_pose and kind == LAST_SAFE_STOP:
            # One tick more, and the evaluations in which the monitor is confirmed.
            wait = (steps_to_confirm(rule) * force.settings[run, SET_EVERY] + 1.0) * period
            fires = is_last_stop(batch, plans, run, objects, wait)
        elif knows_pose:
            fires = of_scene(batch, plans.refuges[run], run, end, rule)
        counted = batch.states[run, monitor]
        if counted[STATE_FROZEN]:
            fires = counted[STATE_RAW] > 0
        else:
            counted[STATE_RAW] = fires
            count(counted, fires, rule)
        confirmed = counted[STATE_CONFIRMED] > 0
        batch.monitors[run, monitor, 0] = fires
        batch.monitors[run, monitor, 1] = confirmed
        if confirmed:
            level = max(level, rule[RULE_LEVEL])
    force.state[run, FORCE_LEVEL] = level
    forget_changes(watch, run)


@inlined
def _choose(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    force: Force,
    run: int,
    objects: int,
    planned: bool,  # noqa: FBT001 - a kernel
    shows: bool,  # noqa: FBT001 - a kernel
) -> None:
    """Take over where the manoeuvre wants it, and choose a stop for it."""
    state, memory, kept = force.state[run], batch.memory[run], plans.kept[run]
    was_stopping = memory[MEMORY_STOPPING] > 0.0
    if not was_stopping:
        record, settings = batch.records[run], force.settings[run]
        shown = look_ahead(settings, plans.refuges[run], batch.pose[run, POSE_S])
        has_parking = shown > ANYWHERE or record["shoulder"] >= record["width"]
        give_way(state, settings, planned and shown == ONLY_REST_AREA, planned and has_parking)
    held = int(state[FORCE_HELD])
    if was_stopping:
        takes = state[FORCE_ASKED] >= REST_AREA
    elif held in (REST_AREA, ROADSIDE_PARKING):
        # Nothing hurries it, so a stop that brakes harder than the usual one is waited out.
        stop = _stop_of(batch, plans, run, objects, held)
        takes = stop != NO_STOP and stop % STOP_LEVELS <= _UNHURRIED
    else:
        takes = held == STOP
    update_stopping(memory, takes, batch.reason[run], batch.pose[run, POSE_ACCELERATION])
    if memory[MEMORY_STOPPING] <= 0.0:
        kept[KEPT_STOP] = NO_STOP
        if was_stopping:
            state[FORCE_HELD] = state[FORCE_ASKED]
        if shows and planned:
            ask_for_stop(batch, plans, run, objects, ANYWHERE, 0.0, NO_STOP)
    elif planned:
        stop = _stop_of(batch, plans, run, objects, held)
        if stop == NO_STOP:
            # What was begun can be had no more.
            state[FORCE_HELD] = STOP
            stop = _stop_of(batch, plans, run, objects, STOP)
        take_stop(plans, run, stop)


@inlined
def _stop_of(batch: Batch, plans: Plans, run: int, objects: int, manoeuvre: int) -> int:
    """Choose a stop that a manoeuvre allows, ``NO_STOP`` if none is feasible."""
    places = ANYWHERE
    if manoeuvre == REST_AREA:
        places = ONLY_REST_AREA
    elif manoeuvre == ROADSIDE_PARKING:
        places = ROADSIDE
    kept = int(plans.kept[run, KEPT_STOP])
    stop = ask_for_stop(batch, plans, run, objects, places, 0.0, kept)
    is_hurried = stop != NO_STOP and stop % STOP_LEVELS > _UNHURRIED
    if places != ANYWHERE and kept != NO_STOP and is_hurried:
        # A better place is not worth a harder braking.
        is_had = plans.found[kept, FOUND_FEASIBLE] > 0.0
        return kept if is_had and plans.found[kept, FOUND_PLACE] >= places else stop
    return stop


@inlined
def _is_danger(batch: Batch, watch: Watch, run: int) -> bool:
    """Tell whether an object ahead is a confirmed danger."""
    for monitor in range(watch.rules.shape[1]):
        is_kind = watch.rules[run, monitor, RULE_KIND] == OBJECT_DANGER
        if is_kind and batch.states[run, monitor, STATE_CONFIRMED] > 0:
            return True
    return False
