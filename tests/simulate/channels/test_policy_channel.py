"""Any policy as a channel: it drives, it is contained, it is told apart by its code."""

import itertools
import math
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.signals import DEGRADED, FAULT, OK, SILENT, ControlCommand, Floats
from adeye.simulate.channels import policy as subject
from adeye.simulate.channels.driving import channel_records
from adeye.simulate.channels.factory import make_channel
from adeye.spec.channels import PolicyParameters
from adeye.testing import World, channel_context, check_channel, drive
from adeye.testing.scenes import passenger_car
from tests.refusals import refused
from tests.simulate.channels.perceived import LINKS, SENSORS, shown
from tests.stored import stored

LANE = 5.25

POLICIES: str = stored("plugins")["policies"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("policies")
    (made / "mine.py").write_text(POLICIES, "utf-8")
    return made


def parameters(name: str = "still", **more: Any) -> PolicyParameters:
    values = {"policy": f"./mine.py:{name}", "normalised": False} | more
    return PolicyParameters.model_validate(values)


def made(folder: Path, name: str, *, runs: int = 1, **more: Any) -> Any:
    channel = make_channel("policy", folder)
    context = channel_context(parameters(name, **more), links=LINKS, sensors=SENSORS, runs=runs)
    channel.reset(context)
    return channel


def ask(channel: Any, speeds: list[float], *, ticks: int = 1, alive: bool = True) -> ControlCommand:
    for tick in range(ticks):
        time = 0.05 * tick
        ego = [[speed * time, LANE, 0.0, speed] for speed in speeds]
        answer = channel.act(shown(ego, time=time, alive=alive, protect=True))
    return answer  # type: ignore[no-any-return]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["keep", "Predictor", "network", "Batched"])
def test_conforms(folder: Path, name: str) -> None:
    check_channel(lambda: subject.PolicyChannel(folder), parameters(name))


def test_tiny_policy_drives_and_stops_for_what_stands_ahead(folder: Path) -> None:
    world = World(objects=lambda _: [[150.0, LANE, 0.0, 0.0, 0.0]], speed=20.0, offset=0.5)
    done = drive({"p": made(folder, "keep")}, {"p": LINKS}, world, horizon=12.0)
    assert done.ego[-1, 3] == 0.0
    assert done.distance.min() > 2.0
    assert done.ego[-1, 1] == pytest.approx(LANE, abs=0.2)


def test_exception_silences_the_run_that_it_is_raised_in_and_no_other(folder: Path) -> None:
    channel = made(folder, "late_failure", runs=2)
    answer = ask(channel, [20.0, 30.0])
    assert answer.status.tolist() == [OK, SILENT]
    assert channel.events[0] is None
    assert channel.events[1].outcome == "channel_error"
    assert "too fast for me (mine.py:" in channel.events[1].detail


def test_answer_that_is_no_action_is_an_invalid_output(folder: Path) -> None:
    wrong = {"three": "shape (3,)", "words": "not numbers", "not_finite": "no finite number"}
    wrong["hidden"] = "masked numbers"
    for name, detail in wrong.items():
        channel = made(folder, name)
        assert ask(channel, [20.0]).status.tolist() == [SILENT]
        assert channel.events[0].outcome == "channel_invalid_output"
        assert detail in channel.events[0].detail


def test_action_is_cut_to_what_the_vehicle_can_follow(folder: Path) -> None:
    answer = ask(made(folder, "beyond"), [20.0])
    assert answer.acceleration.tolist() == [3.0]
    assert answer.steering_angle[0] == pytest.approx(-np.radians(35.0))
    assert ask(made(folder, "beyond", normalised=True), [20.0]).acceleration.tolist() == [3.0]


def test_predictor_is_asked_deterministically_and_gets_its_state_back(folder: Path) -> None:
    channel = made(folder, "Predictor", runs=2)
    assert ask(channel, [20.0, 10.0], ticks=4).acceleration == pytest.approx([0.3, 0.3])


def test_batched_policy_is_asked_once_and_answers_every_run(folder: Path) -> None:
    answer = ask(made(folder, "Batched", runs=3), [20.0, 25.0, 30.0])
    assert answer.acceleration == pytest.approx([1.0, 0.0, -1.0])


def test_dead_sensor_degrades_and_a_missing_estimate_is_a_fault(folder: Path) -> None:
    assert ask(made(folder, "still"), [20.0], alive=False).status.tolist() == [DEGRADED]
    channel = make_channel("policy", folder)
    only = channel_context(parameters(), links=("front",), sensors={"front": "radar"})
    channel.reset(only)
    seen = shown(np.zeros(7), links=("front",), protect=True)
    assert channel.act(seen).status.tolist() == [FAULT]


def test_missing_policy_names_functions_objects_and_classes_of_the_file(folder: Path) -> None:
    caught = refused(SpecError, subject.load_policy, "./mine.py:qqq", folder)
    offered = caught.remedy.removeprefix("Allowed: ").removesuffix(".").split(", ")
    policies = {"keep", "network", "Predictor", "Batched"}
    assert policies <= set(offered)
    assert all(subject.load_policy(f"./mine.py:{name}", folder).source_digest for name in policies)
    assert not {"number", "np", "nothing"} & set(offered)
    for name, message in (("number", "is no policy"), ("nothing", "has no 'nothing'")):
        refused(SpecError, subject.load_policy, f"./mine.py:{name}", folder, says=message)


def observed(objects: list[list[float]], asked: PolicyParameters, ticks: int = 10) -> Any:
    context = channel_context(asked, links=LINKS, sensors=SENSORS)
    fields = {"confirm_hits": 3.0, "coast": 0.5, "gate": 4.0}
    seen = subject.Kinematics(context, channel_records(context, fields))
    for tick in range(ticks):
        time = 0.05 * tick
        rows = [[x + time * speed, y, heading, speed, a] for x, y, heading, speed, a in objects]
        seen.update(shown([20.0 * time, LANE + 0.5, 0.02, 20.0], rows, time))
    return seen.shown(np.array([0]), asked)


def named(row: Floats, features: dict[str, float]) -> dict[str, float]:
    return dict(zip(features, row.tolist(), strict=True))


def test_ego_is_described_as_its_channel_knows_it() -> None:
    ego = named(observed([], parameters())["ego"][0], subject.EGO_FEATURES)
    assert ego["speed"] == pytest.approx(20.0)
    assert ego["lane_offset"] == pytest.approx(0.5, abs=0.1)
    assert ego["heading"] == pytest.approx(0.02, abs=0.01)
    assert ego["to_right_edge"] + ego["to_left_edge"] == pytest.approx(10.5)
    assert ego["desired_speed"] == 30.0


def test_confirmed_objects_come_nearest_first_and_the_other_rows_are_empty() -> None:
    far, near = [90.0, LANE, 0.0, 15.0, 0.0], [30.0, LANE + 3.5, 0.0, 25.0, 0.0]
    rows = observed([far, near], parameters(nearest=4))["objects"][0]
    assert rows.shape == (4, len(subject.OBJECT_FEATURES))
    first, second = (named(row, subject.OBJECT_FEATURES) for row in rows[:2])
    assert (first["present"], second["present"]) == (1.0, 1.0)
    assert first["x"] < second["x"]
    assert first["vx"] == pytest.approx(5.0, abs=1.0)
    assert second["vx"] == pytest.approx(-5.0, abs=1.0)
    assert (rows[2:] == 0.0).all()
    assert not observed([near], parameters(), ticks=2)["objects"].any()


def test_observation_has_its_shape_and_its_limits() -> None:
    for layout, normalised in itertools.product(("kinematics", "kinematics_flat"), (False, True)):
        asked = parameters(observation=layout, normalised=normalised, nearest=5)
        found = observed([[90.0, LANE, 0.0, 500.0, 0.0]], asked)
        parts = list(found.values()) if isinstance(found, dict) else [found]
        assert [part[0].shape for part in parts] in ([(9,), (5, 7)], [(9 + 5 * 7,)])
        limit = 1.0 if normalised else math.inf
        assert all(part.dtype == np.float32 and np.abs(part).max() <= limit for part in parts)


def test_flat_observation_is_what_gymnasium_flattens() -> None:
    """The order of a Dict's parts is that of their names, as in the flat layout."""
    scene = [[60.0, LANE, 0.0, 20.0, 0.0]]
    asked = parameters(nearest=3)
    parts = {name: rows[0] for name, rows in observed(scene, asked).items()}
    flat = observed(scene, parameters(observation="kinematics_flat", nearest=3))[0]
    space = gymnasium.spaces.Dict(
        {name: gymnasium.spaces.Box(-np.inf, np.inf, rows.shape) for name, rows in parts.items()}
    )
    assert flat.tolist() == np.asarray(gymnasium.spaces.flatten(space, parts)).tolist()


def test_normalised_actions_scale_to_each_limit_and_what_is_no_number_stays_none() -> None:
    low, high = subject.action_limits(passenger_car())
    actions = np.array([[-1.0, -1.0], [0.0, 0.0], [0.5, 1.0], [7.0, -7.0]])
    commands = subject.to_command(actions, low, high, normalised=True)
    assert commands[:, 0].tolist() == [-9.0, 0.0, 1.5, 3.0]
    assert commands[:, 1] == pytest.approx(high[1] * np.array([-1.0, 0.0, 1.0, -1.0]))
    for normalised in (False, True):
        assert np.isnan(
            subject.to_command(np.array([np.nan, 0.0]), low, high, normalised=normalised)[0]
        )
