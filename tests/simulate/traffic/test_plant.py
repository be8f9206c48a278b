"""Vehicles that an FMU moves."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.errors import PluginError, SpecError
from adeye.signals import EGO_COLUMNS
from adeye.simulate.traffic import make_traffic
from adeye.sweep.case import TestCase
from tests.motorway import make_case, make_scenario
from tests.refusals import refused
from tests.simulate.bridges.fmus import SHIPPED, car
from tests.stored import read_yaml

PLANT: dict[str, Any] = {
    "file": "./car.fmu",
    "inputs": {"acc": "acceleration", "steer": "steering_angle"},
    "initial": {"x": "x0", "y": "y0", "heading": "psi0", "speed": "v0"},
    "outputs": {"x": "x", "y": "y", "heading": "psi", "speed": "v"},
}
LAGLESS = {"acceleration_lag": "0 s", "steering_lag": "0 s"}


def case(plant: Any = PLANT, speed: float = 30.0, step: float = 0.05, **vehicle: Any) -> TestCase:
    given = {**LAGLESS, **vehicle} | ({} if plant is None else {"plant": plant})
    return make_case(make_scenario(), {"ego_speed": speed}, vehicle=given, step=step)


def drive(cases: list[TestCase], folder: Path, ticks: int = 60) -> np.ndarray[Any, Any]:
    traffic = make_traffic("batch")
    traffic.base_dir = folder
    _, scene = traffic.reset(cases)
    egos = [scene.ego]
    for tick in range(ticks):
        command = np.tile([1.0 if tick < 30 else -2.0, 0.01 * np.sin(0.1 * tick)], (len(cases), 1))
        egos.append(traffic.step(command).ego)
    traffic.close()
    return np.stack(egos, axis=1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("plant")
    car(made)
    return made


def test_what_is_put_in_at_the_start_has_no_start_value(folder: Path) -> None:
    twice = case({**PLANT, "start": {"x0": 9.0}})
    refused(SpecError, drive, [twice], folder, says="'x0' has a start value, and is what .* into")


def test_single_track_in_an_fmu_moves_as_the_built_in_one(folder: Path) -> None:
    mine, theirs = drive([case(), case(None)], folder)
    assert mine[:, :2] == pytest.approx(theirs[:, :2], abs=0.05)
    assert mine[:, 3] == pytest.approx(theirs[:, 3], abs=1e-6)
    assert mine[:, 2] == pytest.approx(theirs[:, 2], abs=2e-3)
    # What the FMU does not tell follows from what it does.
    assert mine[1:, EGO_COLUMNS.index("acceleration")] == pytest.approx(
        np.diff(mine[:, 3]) / 0.05, abs=1e-9
    )
    assert mine[1:, EGO_COLUMNS.index("yaw_rate")] == pytest.approx(
        np.diff(mine[:, 2]) / 0.05, abs=1e-9
    )


def test_runs_beside_it_change_no_bit(folder: Path) -> None:
    alone = drive([case()], folder)[0]
    beside = drive([case(None), case(), case(mass=900.0)], folder)
    assert np.array_equal(beside[1], alone)
    assert np.array_equal(beside[0], drive([case(None)], folder)[0])


def test_world_of_a_kept_trace_is_made_without_its_fmu(tmp_path: Path) -> None:
    traffic = make_traffic("batch")
    traffic.base_dir = tmp_path
    _, scene = traffic.reset([case()])
    assert scene.ego[0].tolist() == drive([case(None)], tmp_path, 0)[0][0].tolist()
    refused(SpecError, traffic.step, np.zeros((1, 2)), says="is not there")


def test_vehicle_whose_fmu_fails_ends_the_campaign(folder: Path) -> None:
    car(folder, "if (t > 0.3) v[6] = NAN;", name="bad")
    bad = case({**PLANT, "file": "./bad.fmu"})
    error = refused(PluginError, drive, [bad], folder, says="'./bad.fmu' failed at 0.3 s")
    assert "x nan (x) is no finite number" in str(error)
    assert error.exit_code == 3


@pytest.mark.parametrize("status", ["-1", "fmi2Discard", "fmi2Error", "fmi2Fatal", "77"])
def test_step_without_a_good_status_is_a_failure(folder: Path, status: str) -> None:
    car(folder, name="ill", status=status)
    ill = case({**PLANT, "file": "./ill.fmu"})
    refused(PluginError, drive, [ill], folder, says="'./ill.fmu' failed at .* status")


@pytest.mark.parametrize(
    ("step", "says"),
    [
        ("if (h > 0 && t == 0) v[6] -= 80;", "at 0 s: .* away from where its speed .* 77 m"),
        ("if (t > 0.32) v[6] -= 60;", r"at 0\.35 s: .* away from .* m in a tick"),
        ("if (t > 0.32) v[7] += 5;", r"at 0\.35 s: .* away from"),
        ("if (t > 0.32) v[9] -= 4;", r"at 0\.35 s: .* changes its speed by 3\.9"),
        ("if (t > 0.32) v[8] += 0.5;", r"at 0\.35 s: .* turns by 0\.50. rad"),
        # It says that it drives, and stands.
        ("v[6] = v[2]; v[7] = v[3];", r"at 0 s: .* away from where its speed"),
    ],
)
def test_vehicle_that_leaps_has_failed(folder: Path, step: str, says: str) -> None:
    car(folder, step, name="leaping")
    leaping = case({**PLANT, "file": "./leaping.fmu"})
    error = refused(PluginError, drive, [leaping], folder, says="'./leaping.fmu' failed at")
    assert re.search(says, str(error)), error


@pytest.mark.parametrize(
    ("law", "speed", "where"),
    [
        # None of them leaps in a tick.
        ("v[6] += 1.8 * h;", 10.0, "along"),
        ("v[6] -= 1.8 * h;", 10.0, "along"),
        ("v[6] += 0.05 * v[9] * h;", 30.0, "along"),
        ("v[7] += 0.8 * v[9] * h;", 20.0, "aside of"),
        # It goes back as fast as it says that it goes on.
        ("v[9] = 0.5; v[6] -= h;", 0.5, "along"),
        # It says that it stands.
        ("v[9] = 0; v[6] += 0.9 * h;", 0.0, "along"),
        ("v[9] = 0; v[7] += 0.9 * h;", 0.0, "aside of"),
    ],
)
@pytest.mark.parametrize("step", [0.05, 0.01])
def test_vehicle_that_is_not_where_its_speed_leads_has_failed(
    folder: Path, law: str, speed: float, where: str, step: float
) -> None:
    car(folder, law, name="creeping")
    creeping = case({**PLANT, "file": "./creeping.fmu"}, speed, step)
    says = f"away from where its speed, .*, brings it {where} its heading"
    refused(PluginError, drive, [creeping], folder, 300, says=says)


@pytest.mark.parametrize("speed", ["v[9]", "v[9] * cos(atan(0.5 * tan(v[1])))"])
def test_vehicle_that_turns_its_wheels_far_goes_where_its_speed_leads(
    folder: Path, speed: str
) -> None:
    # The speed of the place and its part along the vehicle differ by 5 % then.
    car(folder, f"v[11] = {speed};", name="turning")
    told = {**PLANT, "file": "./turning.fmu", "outputs": {**PLANT["outputs"], "speed": "rate"}}
    traffic = make_traffic("batch")
    traffic.base_dir = folder
    traffic.reset([case(told, 5.0)])
    for _ in range(60):
        ego = traffic.step(np.array([[0.0, 0.6]])).ego[0]
    traffic.close()
    assert abs(ego[EGO_COLUMNS.index("heading")]) > 1.0


def test_vehicle_that_steers_across_itself_has_failed(folder: Path) -> None:
    # It tells its speed as that angle.
    steering = case({**PLANT, "outputs": {**PLANT["outputs"], "steering_angle": "v"}})
    refused(PluginError, drive, [steering], folder, says="it steers by")


LIES = {
    ("acceleration", "v[11] = 0;"): "its acceleration, 0 m/s², is not that of its speed",
    ("acceleration", "v[11] = 0.8 * v[0];"): "is not that of its speed",
    ("acceleration", "v[11] = v[0] + 1e9;"): "is not that of its speed",
    ("yaw_rate", "v[11] = 0;"): "its yaw rate, 0 rad/s, is not that of its heading",
    ("yaw_rate", "v[11] = -v[9] * tan(v[1]) / 2.9;"): "is not that of its heading",
}


@pytest.mark.parametrize(("name", "step"), LIES)
def test_rate_that_does_not_lead_where_the_vehicle_is_has_failed(
    folder: Path, name: str, step: str
) -> None:
    car(folder, step, name="lying")
    lying = case({**PLANT, "file": "./lying.fmu", "outputs": {**PLANT["outputs"], name: "rate"}})
    refused(PluginError, drive, [lying], folder, says=LIES[name, step])


def test_acceleration_that_leads_there_is_taken(folder: Path) -> None:
    car(folder, "v[11] = v[0];", name="true")
    told = {**PLANT, "file": "./true.fmu", "outputs": {**PLANT["outputs"], "acceleration": "rate"}}
    egos = drive([case(told)], folder)[0]
    assert egos[5, EGO_COLUMNS.index("acceleration")] == 1.0


def test_vehicle_without_an_fmu_is_identified_as_before() -> None:
    assert "plant" not in case(None).architecture.vehicle.model_dump()
    assert "plant" in case().architecture.vehicle.model_dump()


def test_plant_that_gets_no_steering_is_refused() -> None:
    inputs = {"acc": "acceleration"}
    refused(ValueError, case, {**PLANT, "inputs": inputs}, says="no variable gets steering_angle")


def test_shipped_vehicle_tells_the_acceleration_that_grip_leaves() -> None:
    plant = read_yaml(SHIPPED.parent / "fmu_vehicle.yaml")["vehicle"]["plant"]
    slippery = make_case(
        make_scenario(environment={"friction": 0.6}),
        vehicle={"plant": plant},
    )
    traffic = make_traffic("batch")
    traffic.base_dir = SHIPPED.parent
    _, scene = traffic.reset([slippery])
    speeds, rates = [scene.ego[0, 3]], [0.0]
    for _ in range(140):
        ego = traffic.step(np.array([[-8.0, 0.0]])).ego[0]
        speeds.append(ego[3])
        rates.append(ego[EGO_COLUMNS.index("acceleration")])
    traffic.close()
    assert min(rates) == pytest.approx(-0.6 * 9.81)
    assert (speeds[-1], rates[-1]) == (0.0, 0.0)
    even = 0.05 * (np.array(rates[1:]) + rates[:-1]) / 2.0
    assert np.diff(speeds) == pytest.approx(even, abs=0.1)
