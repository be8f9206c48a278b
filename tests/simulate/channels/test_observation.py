from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest

from adeye.signals import Floats, Observation
from adeye.simulate.channels.driving import channel_records
from adeye.simulate.channels.policy import (
    EGO_FEATURES,
    OBJECT_FEATURES,
    Kinematics,
    action_limits,
    action_space,
    observation_space,
    to_command,
)
from adeye.spec.channels import PolicyParameters
from adeye.testing import channel_context
from adeye.testing.scenes import object_measurement, passenger_car, pose_measurement, straight_road

LANE = 5.25


def parameters(**more: Any) -> PolicyParameters:
    return PolicyParameters.model_validate({"policy": "./p.py:p", "normalised": False} | more)


def observed(objects: list[list[float]], asked: PolicyParameters, ticks: int = 10) -> Any:
    road = straight_road()
    links, sensors = ("front", "pose"), {"front": "radar", "pose": "localisation"}
    context = channel_context(asked, links=links, sensors=sensors)
    fields = {"confirm_hits": 3.0, "coast": 0.5, "gate": 4.0}
    seen = Kinematics(replace(context, road=road), channel_records(context, fields))
    for tick in range(ticks):
        time = 0.05 * tick
        ego = np.array([[20.0 * time, LANE + 0.5, 0.02, 20.0, 0.0, 0.0, 0.0]])
        rows = np.array(objects, dtype=np.float64).reshape(1, -1, 5)
        rows[:, :, 0] += time * rows[:, :, 3]
        front = object_measurement(ego, rows, time)
        measurements = {"front": front, "pose": pose_measurement(road, ego, time)}
        running = np.ones(1, dtype=np.bool_)
        seen.update(Observation(time, measurements, {}, None, running))
    return seen.shown(np.array([0]), asked)


def named(row: Floats, features: dict[str, float]) -> dict[str, float]:
    return dict(zip(features, row.tolist(), strict=True))


def test_ego_is_described_as_its_channel_knows_it() -> None:
    ego = named(observed([], parameters())["ego"][0], EGO_FEATURES)
    assert ego["speed"] == pytest.approx(20.0)
    assert ego["lane_offset"] == pytest.approx(0.5, abs=0.1)
    assert ego["heading"] == pytest.approx(0.02, abs=0.01)
    assert ego["to_right_edge"] + ego["to_left_edge"] == pytest.approx(10.5)
    assert ego["desired_speed"] == 30.0


def test_objects_come_nearest_first_and_the_other_rows_are_empty() -> None:
    far, near = [90.0, LANE, 0.0, 15.0, 0.0], [30.0, LANE + 3.5, 0.0, 25.0, 0.0]
    rows = observed([far, near], parameters(nearest=4))["objects"][0]
    assert rows.shape == (4, len(OBJECT_FEATURES))
    first, second = (named(row, OBJECT_FEATURES) for row in rows[:2])
    assert (first["present"], second["present"]) == (1.0, 1.0)
    assert first["x"] < second["x"]
    assert first["vx"] == pytest.approx(5.0, abs=1.0)
    assert second["vx"] == pytest.approx(-5.0, abs=1.0)
    assert (rows[2:] == 0.0).all()


def test_track_that_is_not_confirmed_is_not_observed() -> None:
    assert not observed([[30.0, LANE, 0.0, 20.0, 0.0]], parameters(), ticks=2)["objects"].any()


@pytest.mark.parametrize("layout", ["kinematics", "kinematics_flat"])
@pytest.mark.parametrize("normalised", [False, True])
def test_observation_is_in_its_space(layout: str, *, normalised: bool) -> None:
    asked = parameters(observation=layout, normalised=normalised, nearest=5)
    shown = observed([[90.0, LANE, 0.0, 500.0, 0.0]], asked)
    one = {k: v[0] for k, v in shown.items()} if isinstance(shown, dict) else shown[0]
    assert observation_space(asked).contains(one)


def test_flat_observation_is_what_gymnasium_flattens() -> None:
    """The order of a Dict's parts is that of their names, as in the flat layout."""
    scene = [[60.0, LANE, 0.0, 20.0, 0.0]]
    asked = parameters(nearest=3)
    parts = {name: rows[0] for name, rows in observed(scene, asked).items()}
    flat = observed(scene, parameters(observation="kinematics_flat", nearest=3))[0]
    flattened = np.asarray(gymnasium.spaces.flatten(observation_space(asked), parts))
    assert flat.tolist() == flattened.tolist()


def test_action_space_is_that_of_the_vehicle() -> None:
    space = action_space(parameters(), passenger_car())
    assert space.shape == (2,)
    assert space.contains(np.array([-9.0, 0.5], dtype=np.float32))
    assert not space.contains(np.array([4.0, 0.0], dtype=np.float32))
    normalised = action_space(parameters(normalised=True), passenger_car())
    assert normalised.contains(np.array([-1.0, 1.0], dtype=np.float32))


def test_normalised_actions_scale_to_each_limit_and_zero_stays_zero() -> None:
    low, high = action_limits(passenger_car())
    actions = np.array([[-1.0, -1.0], [0.0, 0.0], [0.5, 1.0], [7.0, -7.0]])
    commands = to_command(actions, low, high, normalised=True)
    assert commands[:, 0].tolist() == [-9.0, 0.0, 1.5, 3.0]
    assert commands[:, 1] == pytest.approx(high[1] * np.array([-1.0, 0.0, 1.0, -1.0]))


def test_action_that_is_no_number_is_not_made_one() -> None:
    low, high = action_limits(passenger_car())
    for normalised in (False, True):
        assert np.isnan(to_command(np.array([np.nan, 0.0]), low, high, normalised=normalised)[0])
