"""What the ego is able to do: its vehicle and the road."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.judge.outcome import abilities
from adeye.kernel.motion import GRAVITY


def test_vehicle_limits_on_a_dry_road_and_friction_on_ice(hand_made: Any) -> None:
    trace = hand_made(runs=2).trace()
    surroundings = trace.layout.context.surroundings
    friction = replace(surroundings, friction=np.array([1.0, 0.1]))
    context = replace(trace.layout.context, surroundings=friction)
    found = abilities(replace(trace, layout=replace(trace.layout, context=context)))
    assert found[0].tolist() == [9.0, GRAVITY, 3.0]
    assert found[1] == pytest.approx([0.1 * GRAVITY] * 3)
