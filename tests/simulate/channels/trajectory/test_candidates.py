import math

import numpy as np
import pytest

from adeye.kernel.profiles import PATH_ROW, at_path, lay_path
from adeye.signals import Floats
from adeye.simulate.channels.trajectory.candidates import (
    LEVEL_ROW,
    LEVEL_WANTED,
    PROFILES,
    calm_length,
    inside_length,
    quick_length,
    set_accelerations,
)
from tests.simulate.channels.trajectory.record import record


def test_accelerations_rise_from_emergency_to_the_largest() -> None:
    levels = np.zeros((PROFILES + 1, LEVEL_ROW))
    set_accelerations(record(), levels)
    wanted = levels[:PROFILES, LEVEL_WANTED]
    assert (np.diff(wanted) > 0.0).all()
    assert (wanted[0], wanted[4], wanted[-1]) == (-8.0, 0.0, 1.5)


def path(d: float, slope: float, bend: float, target: float, length: float) -> Floats:
    made = np.zeros(PATH_ROW)
    lay_path(made, 100.0, d, slope, bend, target, length)
    return made


@pytest.mark.parametrize("speed", [10.0, 20.0, 36.0])
def test_quick_path_uses_the_assumed_lateral_acceleration_and_no_more(speed: float) -> None:
    limits = record()
    length = quick_length(limits, speed, 3.5)
    made = path(0.0, 0.0, 0.0, 3.5, length)
    bends = [abs(at_path(made, way)[2]) for way in np.linspace(0.0, length, 400)]
    lateral = speed * speed * max(bends)
    assert lateral <= 0.85 * 5.0 + 1e-9
    # At walking pace the steering is the limit, not the tyres.
    assert max(lateral / (0.85 * 5.0), max(bends) / (0.85 * 0.25)) == pytest.approx(1.0, abs=1e-3)


def test_calm_lane_change_takes_its_time() -> None:
    assert calm_length(record(), 30.0, 3.5) == 4.0 * 30.0
    assert inside_length(record(), 30.0, 0.4) == 2.0 * 30.0
    assert math.isclose(inside_length(record(), 0.0, 0.4), quick_length(record(), 0.0, 0.4))
