"""Compile a storyboard: actions as rows of numbers, triggers as postfix programs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from adeye.errors import SpecError
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
    LINEAR,
    SINUSOIDAL,
)
from adeye.signals import Floats, Ints, RoadMap
from adeye.spec.expression import Expression, Program, to_program
from adeye.spec.scenario import Cross, LaneChange, LogicalScenario, SpeedChange, Stop
from adeye.world.formulas import Formulas


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
        _fill_action(row, f"storyboard.{name}", formulas, road)
    ops, args, lengths, programs = _compile_triggers(formulas, index)
    return Script(actions, ops, args, lengths, programs)


def _fill_action(row: Floats, where: str, formulas: Formulas, road: RoadMap) -> None:
    name = where.split(".")[1]
    action = formulas.scenario.storyboard[name].action
    if isinstance(action, LaneChange):
        _fill_lane_change(row, where, formulas, road)
    elif isinstance(action, Cross):
        row[:, ACTION_KIND] = CROSS
        row[:, ACTION_TARGET] = formulas.values(f"{where}.cross.to", lambda s: _cross(s, name).to)
        row[:, ACTION_RATE] = formulas.limited(
            f"{where}.cross.speed", lambda s: _cross(s, name).speed, above=0.0, unit="m/s"
        )
    else:
        row[:, ACTION_KIND] = CHANGE_SPEED
        part = f"{where}.{'speed' if isinstance(action, SpeedChange) else 'stop'}"
        row[:, ACTION_RATE] = formulas.limited(
            f"{part}.rate", lambda s: _pace(s, name).rate, above=0.0, unit="m/s^2"
        )
        row[:, ACTION_JERK] = formulas.limited(
            f"{part}.jerk",
            lambda s: _pace(s, name).jerk,
            above=0.0,
            default=math.inf,
            unit="m/s^3",
        )
        if isinstance(action, SpeedChange):
            row[:, ACTION_TARGET] = formulas.limited(
                f"{part}.to", lambda s: _target(s, name), above=-1e-12, unit="m/s"
            )


def _fill_lane_change(row: Floats, where: str, formulas: Formulas, road: RoadMap) -> None:
    name = where.split(".")[1]
    part = f"{where}.lane_change"
    action = _lane_change(formulas.scenario, name)
    row[:, ACTION_RATE] = formulas.limited(
        f"{part}.lateral_speed",
        lambda s: _lane_change(s, name).lateral_speed,
        above=0.0,
        unit="m/s",
    )
    row[:, ACTION_SHAPE] = SINUSOIDAL if action.shape == "sinusoidal" else LINEAR
    if action.to_lane is None:
        row[:, ACTION_KIND] = CHANGE_BY
        row[:, ACTION_TARGET] = formulas.values(f"{part}.by", lambda s: _lane_change(s, name).by)
        return
    row[:, ACTION_KIND] = CHANGE_TO
    lane = formulas.values(f"{part}.to_lane", lambda s: _lane_change(s, name).to_lane)
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


def _lane_change(scenario: LogicalScenario, event: str) -> LaneChange:
    action = scenario.storyboard[event].lane_change
    assert action is not None
    return action


def _cross(scenario: LogicalScenario, event: str) -> Cross:
    action = scenario.storyboard[event].cross
    assert action is not None
    return action


def _pace(scenario: LogicalScenario, event: str) -> SpeedChange | Stop:
    action = scenario.storyboard[event].speed or scenario.storyboard[event].stop
    assert action is not None
    return action


def _target(scenario: LogicalScenario, event: str) -> Expression:
    action = scenario.storyboard[event].speed
    assert action is not None
    return action.to


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
