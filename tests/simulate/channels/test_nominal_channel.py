"""The nominal channel: when it brakes in an emergency, and what it does without a pose."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.signals import FAULT, OK
from adeye.simulate import engine
from adeye.simulate.channels.nominal import RELEASE, NominalChannel, is_emergency
from adeye.spec.channels import NominalParameters
from adeye.spec.load import load_odd
from adeye.sweep.expand import expand
from adeye.testing import Drive, World, channel_context, drive
from tests.project import CANDIDATE, Project
from tests.simulate.channels.perceived import LINKS, SENSORS, shown

LANE = 5.25
THRESHOLD = NominalParameters().emergency_threshold


def nominal(*, desired: float = 30.0, road: Any = None, **parameters: Any) -> NominalChannel:
    channel = NominalChannel()
    made = NominalParameters.model_validate(parameters)
    channel.reset(
        channel_context(made, links=LINKS, sensors=SENSORS, desired_speed=desired, road=road)
    )
    return channel


def run(world: World, horizon: float, *, desired: float = 30.0, **parameters: Any) -> Drive:
    channel = nominal(desired=desired, road=world.road, **parameters)
    return drive({"nominal": channel}, {"nominal": LINKS}, world, horizon=horizon)


def test_emergency_braking_is_used_only_above_its_threshold() -> None:
    early = World(objects=lambda _: [[300.0, LANE, 0.0, 0.0, 0.0]], speed=20.0)
    gentle = run(early, 25.0, desired=20.0)
    assert gentle.proposals[:, 0, 0].min() >= -THRESHOLD
    late = World(objects=lambda _: [[120.0, LANE, 0.0, 0.0, 0.0]], sight=50.0, speed=20.0)
    sharp = run(late, 12.0, desired=20.0)
    assert sharp.proposals[:, 0, 0].min() == -NominalParameters().emergency_deceleration
    assert sharp.distance.min() > 0.0


def test_channel_is_in_fault_until_the_first_estimate_arrives_and_when_it_stays_away() -> None:
    channel = nominal()
    statuses = []
    for tick in range(16):
        seen = shown([0.0, LANE, 0.0, 20.0], time=0.05 * tick, stamp=0.05 if tick else -1.0)
        statuses.append(int(channel.act(seen).status[0]))
    assert statuses[0] == FAULT
    assert statuses[1:12] == [OK] * 11
    assert statuses[12:] == [FAULT] * 4


def test_object_that_vanishes_close_ahead_of_the_standing_ego_is_not_driven_into() -> None:
    """A narrow sensor does not see what it stands in front of."""
    channel = nominal()
    for tick in range(400):
        time = 0.05 * tick
        ego = [min(2.0 * time, 2.0), LANE, 0.0, 2.0 if time < 1.0 else 0.0]
        sight = 100.0 if time < 2.0 else 1.0
        command = channel.act(shown(ego, [8.0, LANE, 0.0, 0.0, 0.0], time, sight=sight))
    assert command.acceleration[0] < 0.0


SENSOR = {"range": "110 m", "rate": "20 Hz", "latency": "0.1 s", "range_rate_noise": "0.1 m/s"}


def corner_radar(y: int, yaw: int) -> dict[str, Any]:
    mount = {"x": "2.3 m" if abs(yaw) < 90 else "-2.3 m", "y": f"{y} m", "yaw": f"{yaw} deg"}
    view = {"field_of_view": "140 deg", "bearing_noise": "1 deg", "range_noise": "0.2 m"}
    return {**SENSOR, "kind": "radar", "mount": mount, **view}


@pytest.fixture(scope="module")
def contacts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Who touches whom in the same late cut-ins, by suite (B,)."""
    project = Project(tmp_path_factory.mktemp("cut_in") / "project")
    few = project.read(CANDIDATE)
    few["channels"] = {"nominal": few["channels"]["nominal"]}
    few["switch"] = {"policy": "fixed_priority", "priority": ["nominal"], "default": "nominal"}
    del few["sensors"]["truth"]
    old = {"range": "60 m", "latency": "0.15 s", "bearing_noise": "0.15 deg"}
    few["sensors"]["front_camera"].update(old, distance_noise=0.03, field_of_view="40 deg")
    few["sensors"]["front_radar"].update(range="160 m", bearing_noise="0.4 deg")
    corners = {
        f"corner_{index}": corner_radar(*place)
        for index, place in enumerate([(1, 50), (1, 140), (-1, -50), (-1, -140)])
    }
    many = {**few, "sensors": {**few["sensors"], **corners}}
    links = [*few["channels"]["nominal"]["links"], *corners]
    many["channels"] = {"nominal": {**few["channels"]["nominal"], "links": links}}
    for name, suite in (("few", few), ("many", many)):
        project.write(f"odd/architectures/{name}.yaml", {**suite, "architecture": name})
    with project.edited_odd() as odd:
        odd["architectures"] = ["architectures/few.yaml", "architectures/many.yaml"]
        odd["faults"], odd["replicates"] = [], 3
        odd["gate"] = {"architectures": ["many"]}
        parameters = {
            "ego_speed": ["100 km/h", "130 km/h"],
            "relative_speed": ["-40 km/h", "-30 km/h"],
            "gap": ["20 m", "25 m", "30 m", "35 m", "40 m", "50 m"],
            "lateral_speed": ["1 m/s", "1.5 m/s", "2 m/s", "3 m/s"],
        }
        odd["scenarios"] = [{"use": "cut_in", "sweep": {"parameters": parameters}}]
    cases = list(expand(load_odd(project.odd)).cases())
    found = {}
    for name in ("few", "many"):
        trace = engine.run([case for case in cases if case.architecture.architecture == name])
        found[name] = ~trace.complete
    return found


def test_corner_radars_spare_late_cut_ins_and_spoil_hardly_any(contacts: dict[str, Any]) -> None:
    few, many = contacts["few"], contacts["many"]
    assert few.size == many.size == 288
    assert 0 < np.count_nonzero(many) <= 0.75 * np.count_nonzero(few)
    # The samples of more sensors have other errors, so one run may fare worse by chance.
    assert np.count_nonzero(many & ~few) <= 2


def test_emergency_begins_at_the_threshold_and_goes_on_until_the_threat_is_gone() -> None:
    for was, share, expected in (
        (False, 1.0, True),
        (False, 1.0 - 1e-9, False),
        (False, math.inf, True),
        (True, 0.5, True),
        (True, RELEASE, False),
        (True, 0.0, False),
    ):
        required = share * THRESHOLD
        found = is_emergency(was=was, required=required, threshold=THRESHOLD)
        assert found is expected, (was, share)
