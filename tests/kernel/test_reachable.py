"""What the ego reaches before it stands."""

import math

import pytest

from adeye.kernel.encounter import BRAKING, REACTION_TIME, reachable_distance

GRAVITY = 9.80665


@pytest.mark.parametrize("speed", [1.0, 15.0, 36.0])
def test_dry_road_allows_emergency_braking(speed: float) -> None:
    way = speed * REACTION_TIME + speed**2 / (2.0 * BRAKING)
    assert reachable_distance(speed, 0.9) == pytest.approx(way)


def test_slippery_road_limits_the_braking() -> None:
    assert reachable_distance(20.0, 0.3) == pytest.approx(20.0 + 400.0 / (2.0 * 0.3 * GRAVITY))


def test_it_grows_with_speed_and_falls_with_friction() -> None:
    by_speed = [reachable_distance(speed, 0.7) for speed in (0.0, 5.0, 10.0, 30.0)]
    assert by_speed == sorted(by_speed)
    assert by_speed[0] == 0.0
    by_friction = [reachable_distance(20.0, friction) for friction in (0.1, 0.3, 0.6)]
    assert by_friction == sorted(by_friction, reverse=True)


def test_unknown_speed_is_unknown() -> None:
    assert math.isnan(reachable_distance(math.nan, 0.5))
