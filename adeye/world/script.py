"""Compile a storyboard: actions as rows of numbers, triggers as postfix programs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.errors import SpecError
from adeye.kernel.manoeuvre import LINEAR, SINUSOIDAL
from adeye.kernel.storyboard import (
    ACTION_ACTOR,
    ACTION_DELAY,
    ACTION_JERK,
    ACTION_KIND,
    ACTION_RATE,
    ACTION_RELATIVE,
    ACTION_SHAPE,
    ACTION_TARGET,
    ACTION_WIDTH,
    CHANGE_BY,
    CHANGE_SPEED,
    CHANGE_TO,
    CROSS,
)
from adeye.spec.expression import Expression, Program, to_program
from adeye.world.formulas import BELOW_ZERO, Formulas, Pick

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.signals import Floats, Ints, RoadMap
    from adeye.spec.scenario import LogicalScenario


@dataclass(frozen=True, slots=True)
class Script:
    """The storyboard of a batch with V events.

    Attributes:
        actions: (B, V, ACTION_WIDTH), see ``kernel.storyboard``.
        ops: (P, L) operations of the P different trigger programs.
        args: (P, L) their arguments.
        lengths: (P,) how many operations belong to each.
        programs: (B, V) program of each event.
        order: (V,) the events in the order in which those of one tick act.
    """

    actions: Floats
    ops: Ints
    args: Floats
    lengths: Ints
    programs: Ints
    order: Ints


WALKER: Final = "pedestrian"
"""The kind of actor that goes where it likes and stands beside roads; the others have wheels."""

STEEPEST_START: Final = math.radians(45.0)
"""Angle to the road at which a vehicle that starts may change lanes [rad]. Our choice."""

_ROUNDING: Final = 1e-9
"""Of a number of ticks, and of a sine."""


def compile_script(
    formulas: Formulas, road: RoadMap, index: Mapping[str, int], step: float
) -> Script:
    """Compile the storyboard of each run.

    Args:
        formulas: Scenarios of the batch with their parameters.
        road: The road of each run.
        index: Column of each trigger variable.
        step: Master clock [s].

    Raises:
        SpecError: A target lane does not exist, a rate is not positive, a delay is negative, or a
            vehicle is to do what only walkers can.
    """
    scenario = formulas.scenario
    actors = list(scenario.actors)
    actions = np.zeros((formulas.runs, len(scenario.storyboard), ACTION_WIDTH))
    for number, (name, event) in enumerate(scenario.storyboard.items()):
        row = actions[:, number]
        row[:, ACTION_ACTOR] = actors.index(event.actor)
        row[:, ACTION_JERK] = math.inf
        row[:, ACTION_RELATIVE] = -1.0
        delay = formulas.limited(
            f"storyboard.{name}.delay",
            lambda s, name=name: s.storyboard[name].delay,  # type: ignore[misc]
            above=BELOW_ZERO,
            default=0.0,
            unit="s",
        )
        row[:, ACTION_DELAY] = np.ceil(delay / step - _ROUNDING)
        _fill_action(row, name, formulas, road)
        if event.speed is not None and event.speed.relative_to is not None:
            row[:, ACTION_RELATIVE] = index[f"{event.speed.relative_to}.speed"]
    events = list(scenario.storyboard)
    order = np.array([events.index(name) for name in scenario.acting_order], dtype=np.int64)
    return Script(actions, *_compile_triggers(formulas, index), order)


def _fill_action(row: Floats, name: str, formulas: Formulas, road: RoadMap) -> None:
    event = formulas.scenario.storyboard[name]
    where = f"storyboard.{name}"
    if event.lane_change is not None:
        _fill_lane_change(row, name, formulas, road)
    elif event.cross is not None:
        if formulas.scenario.actors[event.actor].kind != WALKER:
            raise SpecError(
                f"{where}.cross: {event.actor} has wheels and cannot turn on the spot",
                remedy="Let it start with heading: 90 deg, and drive across by its speed.",
            )
        row[:, ACTION_KIND] = CROSS
        row[:, ACTION_TARGET] = formulas.values(f"{where}.cross.to", _field(name, "cross", "to"))
        row[:, ACTION_RATE] = formulas.limited(
            f"{where}.cross.speed", _field(name, "cross", "speed"), above=0.0, unit="m/s"
        )
    else:
        row[:, ACTION_KIND] = CHANGE_SPEED
        action = "stop" if event.speed is None else "speed"
        row[:, ACTION_RATE] = formulas.limited(
            f"{where}.{action}.rate", _field(name, action, "rate"), above=0.0, unit="m/s^2"
        )
        row[:, ACTION_JERK] = formulas.limited(
            f"{where}.{action}.jerk",
            _field(name, action, "jerk"),
            above=0.0,
            default=math.inf,
            unit="m/s^3",
        )
        if event.speed is not None:
            row[:, ACTION_TARGET] = formulas.limited(
                f"{where}.speed.to",
                _field(name, "speed", "to"),
                above=BELOW_ZERO if event.speed.relative_to is None else -math.inf,
                unit="m/s",
            )


def _fill_lane_change(row: Floats, name: str, formulas: Formulas, road: RoadMap) -> None:
    event = formulas.scenario.storyboard[name]
    action, actor = event.lane_change, event.actor
    if formulas.scenario.actors[actor].kind != WALKER:
        where = f"actors.{actor}.start.heading"
        heading = formulas.values(where, lambda s: s.actors[actor].start.heading, 0.0)
        across = np.abs(np.sin(heading)) > np.sin(STEEPEST_START) + _ROUNDING
        if across.any():
            raise SpecError(
                f"{where}: {np.degrees(heading[across][0]):g} deg is across the road, and "
                f"storyboard.{name} is a lane change along it",
                remedy=f"Start within {np.degrees(STEEPEST_START):g} deg of the road's direction.",
            )
    part = f"storyboard.{name}.lane_change"
    row[:, ACTION_RATE] = formulas.limited(
        f"{part}.lateral_speed",
        _field(name, "lane_change", "lateral_speed"),
        above=0.0,
        unit="m/s",
    )
    linear = action is not None and action.shape == "linear"
    row[:, ACTION_SHAPE] = LINEAR if linear else SINUSOIDAL
    if action is None or action.to_lane is None:
        row[:, ACTION_KIND] = CHANGE_BY
        row[:, ACTION_TARGET] = formulas.values(f"{part}.by", _field(name, "lane_change", "by"))
        return
    row[:, ACTION_KIND] = CHANGE_TO
    lane = formulas.values(f"{part}.to_lane", _field(name, "lane_change", "to_lane"))
    check_lanes(f"{part}.to_lane", lane, road.lanes)
    row[:, ACTION_TARGET] = (lane + 0.5) * road.lane_width


def check_lanes(what: str, lane: Floats, lanes: int) -> None:
    """Refuse lane numbers that the road does not have.

    Args:
        what: Name of the field, for the message.
        lane: (B,) numbers.
        lanes: How many the road has.

    Raises:
        SpecError: A number is broken, negative or too large.
    """
    bad = (lane != np.floor(lane)) | (lane < 0) | (lane >= lanes)
    if bad.any():
        raise SpecError(
            f"{what}: {lane[bad][0]:g} is no lane of a road with lanes 0 to {lanes - 1}",
            remedy="Lanes are counted from 0 at the right.",
        )


def _field(event: str, action: str, field: str) -> Pick:
    """Take a formula of an event's action; scenarios of one structure have the same actions."""

    def pick(scenario: LogicalScenario) -> Expression | None:
        found: Expression | None = getattr(getattr(scenario.storyboard[event], action), field)
        return found

    return pick


def _compile_triggers(
    formulas: Formulas, index: Mapping[str, int]
) -> tuple[Ints, Floats, Ints, Ints]:
    known: dict[str, int] = {}
    compiled: list[Program] = []
    numbers = np.zeros((formulas.runs, len(formulas.scenario.storyboard)), dtype=np.int64)
    for scenario, rows, _ in formulas.parts:
        for column, event in enumerate(scenario.storyboard.values()):
            text = event.when.text
            if text not in known:
                known[text] = len(compiled)
                compiled.append(to_program(event.when, index))
            numbers[rows, column] = known[text]
    width = max((len(program.ops) for program in compiled), default=0)
    ops = np.zeros((len(compiled), width), dtype=np.int64)
    args = np.zeros((len(compiled), width))
    for number, program in enumerate(compiled):
        ops[number, : len(program.ops)] = program.ops
        args[number, : len(program.args)] = program.args
    lengths = np.array([len(program.ops) for program in compiled], dtype=np.int64)
    return ops, args, lengths, numbers
