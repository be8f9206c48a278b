"""Encounters of a whole run are those of its rows, whatever the bounds leave out."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from adeye.judge.conflict import reach_of
from adeye.judge.metrics import METRICS
from adeye.judge.metrics.encounters import ENCOUNTER_DISTANCE, ENCOUNTER_HORIZON
from adeye.kernel.boxes import box_distance
from adeye.kernel.encounter import (
    closest_encounter,
    planar_time_to_collision,
    worst_time_to_collision,
)
from adeye.kernel.motion import GRAVITY


def expected(made: Any) -> list[float]:
    """The same from every row and object, without bounds."""
    best = [math.inf] * 4
    for row in range(made.rows):
        x, y, heading, speed = made.columns["ego"][0, row, :4]
        for index in range(len(made.objects)):
            ox, oy, o_heading, o_speed = made.columns["objects"][0, row, index, :4]
            length, width = made.sizes[0, index, :2]
            motion = (
                ox - x, oy - y, o_speed * math.cos(o_heading) - speed * math.cos(heading),
                o_speed * math.sin(o_heading) - speed * math.sin(heading),
            )  # fmt: skip
            bodies = (heading, 4.0, 2.0, o_heading, length, width)
            reach = reach_of(4.0, 2.0) + reach_of(length, width)
            time, distance = closest_encounter(*motion, *bodies)
            if time > ENCOUNTER_HORIZON:
                time = 0.0
                distance = box_distance(x, y, heading, 4.0, 2.0, ox, oy, o_heading, length, width)
            best[0] = min(best[0], planar_time_to_collision(*motion, *bodies))
            best[1] = min(best[1], worst_time_to_collision(*motion, reach, 2.0 * GRAVITY))
            best[2] = min(best[2], distance)
            if distance <= ENCOUNTER_DISTANCE:
                best[3] = min(best[3], time)
    return best


@pytest.mark.parametrize("seed", range(25))
def test_bounds_leave_nothing_out(hand_made: Any, seed: int) -> None:
    draw = np.random.default_rng(seed)
    names = tuple("abcd")
    made = hand_made(objects=names)
    time = made.time
    made.ego(d=5.25 + 0.3 * np.sin(time), heading=0.05 * draw.normal())
    for name in names:
        speed, heading = draw.uniform(0.0, 35.0), draw.choice([0.0, np.pi / 2.0, np.pi])
        heading += draw.normal(0.0, 0.1)
        along, across = speed * np.cos(heading), speed * np.sin(heading)
        made.object(
            name, s=draw.uniform(-30.0, 90.0) + along * time,
            d=draw.uniform(-20.0, 30.0) + across * time, speed=speed, heading=heading,
            size=(draw.uniform(0.5, 8.0), draw.uniform(0.5, 2.5)),
        )  # fmt: skip
    wanted = expected(made)
    for column, value in zip(
        ("min_ttc_2d_s", "min_wttc_s", "min_dce_m", "min_ttce_s"), wanted, strict=True
    ):
        found = METRICS[column].compute(made.trace())
        if value == math.inf:
            assert found.status == ("no_conflict",), column
        else:
            assert found.value[0] == pytest.approx(value, rel=1e-9, abs=1e-9), column
