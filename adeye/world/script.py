"""Compile a storyboard: actions as rows of numbers, triggers as postfix programs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from adeye.errors import SpecError
from adeye.kernel.manoeuvre import LINEAR, SINUSOIDAL
from adeye.kernel.storyboard import (
    ACTION_ACTOR,
    ACTION_JERK,
    ACTION_KIND,
    ACTION_RATE,
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
    """

    actions: Floats
    ops: Ints
    args: Floats
    lengths: Ints
    programs: Ints


def compile_script(formulas: Formulas, road: RoadMap, index: Mapping[str, int]) -> Script:
    """Compile the storyboard of each run.

    Args:
        formulas: Scenarios of the batch with their parameters.
        road: The road of each run.
        index: Column of each trigger variable.

    Raises:
        SpecError: A target lane does not exist, or a rate is not positive.
    """
    scenario = formulas.scenario
    actors = list(scenario.actors)
    actions = np.zeros((formulas.runs, len(scenario.storyboard), ACTION_WIDTH))
    for number, (name, event) in enumerate(scenario.storyboard.items()):
        row = actions[:, number]
        row[:, ACTION_ACTOR] = actors.index(event.actor)
        row[:, ACTION_JERK] = math.inf
        _fill_action(row, name, formulas, road)
    ops, args, lengths, programs = _compile_triggers(formulas, index)
    return Script(actions, ops, args, lengths, programs)


def _fill_action(row: Floats, name: str, formulas: Formulas, road: RoadMap) -> None:
    event = formulas.scenario.storyboard[name]
    where = f"storyboard.{name}"
    if event.lane_change is not None:
        _fill_lane_change(row, name, formulas, road)
    elif event.cross is not None:
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
                f"{where}.speed.to", _field(name, "speed", "to"), above=BELOW_ZERO, unit="m/s"
            )


def _fill_lane_change(row: Floats, name: str, formulas: Formulas, road: RoadMap) -> None:
    action = formulas.scenario.storyboard[name].lane_change
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
