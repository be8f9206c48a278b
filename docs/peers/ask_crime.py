"""Ask CommonRoad-CriMe for its measures of an ego behind another vehicle on a straight lane.

pip install commonroad-crime==0.4.5 in an environment of its own; python -m docs.peers.ask_crime

CriMe rounds most of its measures to two digits. Here its rounding is switched off, so that formulas
are compared and not their last digit; what is searched for in steps of time stays so.
"""

from __future__ import annotations

import contextlib
import io
import logging
import math
import sys
import warnings
from importlib.metadata import version
from typing import Any

import commonroad_crime.measure as measures
import numpy as np
from commonroad.geometry.shape import Rectangle
from commonroad.prediction.prediction import TrajectoryPrediction
from commonroad.scenario.lanelet import Lanelet, LaneletNetwork
from commonroad.scenario.obstacle import DynamicObstacle, ObstacleType
from commonroad.scenario.scenario import Scenario, ScenarioID
from commonroad.scenario.state import CustomState, InitialState
from commonroad.scenario.trajectory import Trajectory
from commonroad_crime.data_structure.configuration import CriMeConfiguration
from commonroad_crime.utility import general

from docs.peers.states import ANSWERS, draw, read, write

PEER = "commonroad-crime"
COUNT = 200
STEP = 0.1
ROWS = 60
TILT = 1e-4
"""Heading of the road for what CriMe answers with 0 where the heading is 0 [rad]."""
ROAD = 1500.0
HALF = 2.0
"""Of the width of the lane [m]."""
EGO, OTHER, LANE = 1, 2, 3
WIDTH = 2.0
EGO_SIZE = (4.0, WIDTH)
ALONE = {"TTB", "TTK", "TTCStar"}
EVEN = {
    "gap": "HW",
    "time_gap": "THW",
    "ttc": "TTC",
    "planar_ttc": "TTCStar",
    "dst": "DST",
    "required": "ALongReq",
    "required_along_x": "ALongReq",
    "btn": "BTN",
    "stn": "STN",
    "wttc": "WTTC",
    "dce": "DCE",
    "ttce": "TTCE",
    "ttb": "TTB",
    "ttk": "TTK",
    "delta_v": "DeltaV",
}
TILTED = {"required", "btn", "required_braking"}
CHANGING = {"ettc": "TTC", "required_braking": "ALongReq"}


def unrounded(value: float, _: object = 1) -> float:
    """Stand for CriMe's rounding."""
    return float(value)


general.int_round = unrounded


def vehicle(number: int, motion: list[float], size: tuple[float, float], tilt: float) -> Any:
    """Build a vehicle that drives along the lane at constant acceleration, until it stands."""
    start, speed, acceleration = motion
    states = []
    for row in range(ROWS + 1):
        time = row * STEP
        if acceleration < 0.0:
            time = min(time, speed / -acceleration)
        way = start + speed * time + 0.5 * acceleration * time * time
        states.append(
            {
                "time_step": row,
                "position": np.array([way * math.cos(tilt), way * math.sin(tilt)]),
                "orientation": tilt,
                "velocity": speed + acceleration * time,
                "acceleration": acceleration,
            }
        )
    shape = Rectangle(*size)
    lanes = {row: {LANE} for row in range(ROWS + 1)}
    path = Trajectory(1, [CustomState(**state) for state in states[1:]])
    predicted = TrajectoryPrediction(path, shape, lanes, lanes)
    first = InitialState(**states[0], yaw_rate=0.0, slip_angle=0.0)
    return DynamicObstacle(number, ObstacleType.CAR, shape, first, predicted)


def scene(ego: Any, other: Any, tilt: float) -> CriMeConfiguration:
    """Put both vehicles on one straight lane."""
    along = np.linspace(-50.0, ROAD, 156)
    turn = np.array([[math.cos(tilt), math.sin(tilt)], [-math.sin(tilt), math.cos(tilt)]])
    sides = [np.stack([along, np.full_like(along, d)], axis=1) @ turn for d in (HALF, 0.0, -HALF)]
    lane = Lanelet(*sides, LANE)
    made = Scenario(STEP, ScenarioID())
    made.add_objects(LaneletNetwork.create_from_lanelet_list([lane]))
    made.add_objects([ego, other])
    made.assign_obstacles_to_lanelets()
    configuration = CriMeConfiguration()
    configuration.update(ego_id=EGO, sce=made)
    return configuration


def answer(name: str, configuration: CriMeConfiguration) -> float:
    """Ask for one measure at the first step."""
    measure = getattr(measures, name)(configuration)
    other = {} if name in ALONE else {"vehicle_id": OTHER}
    return float(measure.compute(time_step=0, verbose=False, **other))


def asked(name: str, state: list[float], tilt: float) -> float:
    """Ask about gap, speeds, accelerations and the other's length."""
    gap, rear, front, a_rear, a_front, length = state
    own = vehicle(EGO, [0.0, rear, a_rear], EGO_SIZE, tilt)
    # CriMe adds half of a length to both coordinates of a place.
    start = gap + 0.5 * (EGO_SIZE[0] + length) * (math.cos(tilt) + math.sin(tilt))
    other = vehicle(OTHER, [start, front, a_front], (length, WIDTH), tilt)
    return answer(name, scene(own, other, tilt))


def answers(chosen: list[str]) -> dict[str, Any]:
    """Give the states of each measure with its value."""
    found: dict[str, Any] = {}
    names = ["gap", "v_rear", "v_front", "front_length"]
    even = draw(COUNT, [(2, 100), (5, 40), (0, 30), (3, 12)], 1)
    for ours in (name for name in EVEN if name in chosen):
        tilt = TILT if ours in TILTED else 0.0
        found[ours] = (
            names,
            [[*row, asked(EVEN[ours], [*row[:3], 0.0, 0.0, row[3]], tilt)] for row in even],
        )
        sys.stderr.write(f"{ours}\n")
    names = ["gap", "v_rear", "v_front", "a_rear", "a_front"]
    changing = draw(COUNT, [(2, 100), (15, 40), (10, 30), (-2, 2), (-3, 1.5)], 1)
    for ours in (name for name in CHANGING if name in chosen):
        tilt = TILT if ours in TILTED else 0.0
        rows = [[*row, asked(CHANGING[ours], [*row, 4.0], tilt)] for row in changing]
        found[ours] = (names, rows)
        sys.stderr.write(f"{ours}\n")
    return found


def known() -> dict[str, Any]:
    """Give what is stored already."""
    if not (ANSWERS / f"{PEER}.json").exists():
        return {}
    stored = read(PEER)["metrics"]
    return {name: (item["arguments"], item["rows"]) for name, item in stored.items()}


def main(chosen: list[str]) -> None:
    """Ask for some of the measures, or all, and store them beside the others."""
    warnings.simplefilter("ignore")
    logging.disable(logging.CRITICAL)
    every = [*EVEN, *CHANGING]
    for name in chosen or every:
        with contextlib.redirect_stdout(io.StringIO()):
            found = answers([name])
        whole = known() | found
        write(PEER, version(PEER), {name: whole[name] for name in every if name in whole})


if __name__ == "__main__":
    main(sys.argv[1:])
