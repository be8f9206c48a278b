"""The parts of the bench: contracts of a channel, and each flaw changes something."""

import math

import numpy as np
import pytest

from adeye.selftest.parts import Car
from adeye.testing import check_channel


def car(flaw: str = "none") -> Car:
    made = object.__new__(Car)
    made.flaw, made.desired_speed, made.wheelbase, made.tick = flaw, 25.0, 2.9, 0  # type: ignore[assignment]
    made.last, made.rate = (-1.0, math.inf), 0.0
    return made


@pytest.mark.parametrize("flaw", ["none", "oscillates", "degrees"])
def test_car_keeps_the_contract_of_a_channel(flaw: str) -> None:
    check_channel(Car, Car.Parameters.model_validate({"flaw": flaw}))


def test_good_car_brakes_for_what_is_near_and_the_flawed_ones_do_not() -> None:
    assert car()._drive(25.0, 20.0) < -4.0
    assert car("never_brakes")._drive(25.0, 20.0) == 0.0
    assert car("ignores")._drive(25.0, 20.0) == 0.0
    assert car("brakes_late")._drive(25.0, 50.0) == 0.0
    assert car()._drive(25.0, 50.0) < 0.0


def test_car_looks_along_the_curve() -> None:
    detections = np.array([[40.0, 2.0, 0, 0, 4, 2, 0], [20.0, -3.5, 0, 0, 4, 2, 0]])
    assert car()._look(detections, 1.0 / 400.0) == 40.0
    assert car()._look(detections * [1, -1, 1, 1, 1, 1, 1], 1.0 / 400.0) == math.inf


def test_car_learns_the_rate_once_a_sample() -> None:
    made = car()
    for stamp, ahead in ((0.0, 50.0), (0.1, 49.0), (0.1, 10.0)):
        made._track(stamp, ahead)
    assert made.rate == pytest.approx(-10.0)
