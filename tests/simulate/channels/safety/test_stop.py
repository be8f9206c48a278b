import pytest

from adeye.kernel.stops import ONSET_JERK
from adeye.signals import parameter_record
from adeye.simulate.channels.driving import HOLD_DECELERATION
from adeye.simulate.channels.safety.monitors import stop_acceleration

STEP = 0.05
RECORD = parameter_record(
    {"stop_deceleration": [4.0], "emergency_deceleration": 8.0, "period": STEP}
)[0]


def stop(ticks: int, required: float, *, start: float = 0.0) -> list[float]:
    accelerations = [start]
    for _ in range(ticks):
        accelerations.append(
            stop_acceleration(RECORD, accelerations[-1], 20.0, required, is_danger=True)
        )
    return accelerations[1:]


def test_stop_builds_up_at_the_onset_jerk_to_the_stop_deceleration() -> None:
    ramp = stop(10, 0.0)
    assert ramp[:3] == pytest.approx([-ONSET_JERK * STEP * k for k in (1, 2, 3)])
    assert ramp[-1] == -4.0


def test_object_ahead_is_braked_for_at_once_with_a_reserve() -> None:
    assert stop(1, 5.0)[-1] == pytest.approx(-5.0)
    assert stop(3, 5.0)[-1] == pytest.approx(-6.0)


def test_no_more_than_the_emergency_deceleration_is_asked_for() -> None:
    assert stop(3, 50.0)[-1] == -8.0
    assert stop(3, float("inf"))[-1] == -8.0


def test_braking_is_not_taken_back_before_standstill() -> None:
    assert stop_acceleration(RECORD, -7.0, 10.0, 0.0, is_danger=True) == -7.0


def test_standing_ego_is_held() -> None:
    assert stop_acceleration(RECORD, -7.0, 0.0, 0.0, is_danger=True) == -HOLD_DECELERATION


def test_healed_danger_leaves_the_stop_its_own_deceleration() -> None:
    acceleration = -7.0
    for _ in range(40):
        acceleration = stop_acceleration(RECORD, acceleration, 10.0, 0.0, is_danger=False)
    assert acceleration == -RECORD["stop_deceleration"]
