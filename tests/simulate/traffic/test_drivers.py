"""Actors that an FMU drives: what it is told, how the actor moves, what is refused."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.errors import PluginError, SpecError
from adeye.identity import file_digest
from adeye.signals import (
    OBJECT_HEADING,
    OBJECT_SPEED,
    OBJECT_X,
    OBJECT_Y,
    PLACE_D,
    PLACE_OFFSET,
    PLACE_S,
    Scene,
)
from adeye.simulate.traffic import make_traffic
from adeye.simulate.traffic.drivers import wire_driver
from adeye.simulate.world.check import check_scenario
from adeye.spec.load import load_scenario
from adeye.spec.programs import DRIVER_SIGNALS
from adeye.spec.scenario import Driver
from adeye.sweep.case import TestCase, content_digest, structure_key
from tests.motorway import MOTORWAY, make_case, make_scenario, merged
from tests.refusals import refused
from tests.simulate.bridges.fmus import Var, build_fmu
from tests.stored import write_yaml

HELD = {"acceleration": "a"}
ASIDE = {**HELD, "lateral_speed": "aside"}


def echo(folder: Path, step: str = "", name: str = "echo", unit: str = "") -> Path:
    """Build a driver: ``a`` and ``aside`` are parameters, unless the step says otherwise."""
    variables = [
        Var("u", "input", unit=unit),
        Var("k", "parameter"),
        Var("turn", "parameter"),
        Var("a", "output"),
        Var("aside", "output"),
    ]
    return build_fmu(folder, name, variables, f"v[3] = v[1]; v[4] = v[2]; {step}")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("driver")
    echo(made)
    return made


def driver(folder: Path, name: str = "echo", **more: Any) -> dict[str, Any]:
    return {
        "file": f"./{name}.fmu",
        "inputs": {"u": "time"},
        "outputs": ASIDE,
        "digest": file_digest(folder / f"{name}.fmu"),
        **more,
    }


def lead(given: Mapping[str, Any], **start: Any) -> dict[str, Any]:
    begins = {"lane": 1, "ahead_of": "ego", "gap": "gap", "speed": "20 m/s", **start}
    return {"kind": "car", "start": begins, "driver": dict(given)}


def case(actors: Mapping[str, Any], **more: Any) -> TestCase:
    return make_case(make_scenario(actors=dict(actors), **more))


def drive(
    cases: list[TestCase], folder: Path, ticks: int = 20, backend: str = "batch"
) -> list[Scene]:
    traffic = make_traffic(backend)
    traffic.scenario_dir = folder
    _, scene = traffic.reset(cases)
    scenes = [scene]
    try:
        scenes += [traffic.step(np.zeros((len(cases), 2))) for _ in range(ticks)]
    finally:
        traffic.close()
    return scenes


@pytest.mark.parametrize("backend", ["batch", "highway"])
def test_actor_moves_as_its_driver_says(folder: Path, backend: str) -> None:
    given = driver(folder, start={"k": 2.0, "turn": 0.5})
    scenes = drive([case({"lead": lead(given)})], folder, 20, backend)
    first, last = (scene.objects[0, 0] for scene in (scenes[0], scenes[-1]))
    assert last[OBJECT_SPEED] == pytest.approx(22.0)
    # Half a metre to the left in a second, of the 21 m that it drives.
    assert last[OBJECT_Y] - first[OBJECT_Y] == pytest.approx(0.5)
    assert last[OBJECT_X] - first[OBJECT_X] == pytest.approx(21.0, abs=0.01)
    assert last[OBJECT_HEADING] == pytest.approx(0.5 / 22.0, rel=0.02)


def test_it_stands_when_it_has_stopped_and_turns_no_more(folder: Path) -> None:
    given = driver(folder, start={"k": -8.0, "turn": 0.5})
    scenes = drive([case({"lead": lead(given, speed="4 m/s")})], folder, 40)
    states = np.array([scene.objects[0, 0] for scene in scenes])
    assert states[-1, OBJECT_SPEED] == 0.0
    assert states[-1, OBJECT_X] - states[0, OBJECT_X] == pytest.approx(1.0, abs=0.05)
    assert np.array_equal(states[-1, :4], states[-10, :4])


def test_it_keeps_its_offset_in_a_bend_and_drives_there_what_it_says(folder: Path) -> None:
    road = {"kind": "curve", "radius": "2000 m"}
    given = driver(folder, outputs=HELD)
    actors = {"lead": lead(given, offset="0.5 m")}
    scenes = drive([case(actors, world={"road": road})], folder, 40)
    places = np.array([scene.object_places[0, 0] for scene in scenes])
    points = np.array([scene.objects[0, 0, :2] for scene in scenes])
    assert places[:, PLACE_OFFSET] == pytest.approx(np.full(41, 0.5), abs=1e-6)
    ways = np.hypot(*np.diff(points, axis=0).T)
    assert ways == pytest.approx(np.full(40, 1.0), rel=1e-4)


def test_oncoming_actor_drives_its_own_way(folder: Path) -> None:
    road = {"opposite_lanes": 1, "lanes": 2}
    given = driver(folder, start={"turn": 0.5})
    begins = {"lane": 0, "s": "500 m", "oncoming": True, "ahead_of": None, "gap": None}
    scenes = drive([case({"lead": lead(given, **begins)}, world={"road": road})], folder, 20)
    before, after = (scene.object_places[0, 0] for scene in (scenes[0], scenes[-1]))
    assert after[PLACE_S] - before[PLACE_S] == pytest.approx(-20.0, abs=0.02)
    # Its own left is right of the road.
    assert after[PLACE_D] - before[PLACE_D] == pytest.approx(-0.5, abs=1e-6)


SIGNALS = {
    "time": 0.0,
    "own.speed": 20.0,
    "own.acceleration": 0.0,
    "own.heading": 0.0,
    "own.lane_offset": 0.5,
    "own.curvature": 0.0,
    "own.desired_speed": 33.0,
    "lead.present": 1.0,
    "lead.gap": 91.7,
    "lead.speed": 15.0,
    "objects.1.present": 1.0,
    "objects.2.present": 1.0,
    "objects.2.x": 91.7 + 0.5 * (4.5 + 12.0),
    "objects.2.vx": -5.0,
    "objects.2.length": 12.0,
    "objects.3.present": 0.0,
    "objects.3.x": 0.0,
}
"""What the driver of a car is told that has a truck ahead and the ego behind it in another lane."""


@pytest.mark.slow
@pytest.mark.parametrize("signal", SIGNALS)
def test_each_signal_says_what_it_says(tmp_path: Path, signal: str) -> None:
    echo(tmp_path, "v[3] = 0.1 * v[0];")
    given = driver(tmp_path, inputs={"u": signal}, desired_speed="33 m/s", outputs=HELD)
    actors = {
        "lead": lead(given, offset="0.5 m"),
        "truck": {
            "kind": "truck",
            "start": {"lane": 1, "ahead_of": "lead", "gap": "91.7 m", "speed": "15 m/s"},
            "size": {"length": "12 m", "width": "2.5 m", "height": "3.8 m"},
        },
    }
    scenes = drive([case(actors)], tmp_path, 1)
    told = (scenes[1].objects[0, 0, OBJECT_SPEED] - 20.0) / 0.05 / 0.1
    assert told == pytest.approx(SIGNALS[signal], abs=1e-6)


def test_objects_are_as_many_as_a_driver_is_told_of() -> None:
    assert sum(name.endswith(".present") for name in DRIVER_SIGNALS) == 1 + 8


def test_runs_beside_it_change_no_bit(folder: Path) -> None:
    cases = [case({"lead": lead(driver(folder, start={"k": k, "turn": 0.1}))}) for k in (0.5, -1.0)]
    both = drive(cases, folder)[-1].objects
    for run, item in enumerate(cases):
        assert np.array_equal(drive([item], folder)[-1].objects[0], both[run])


def test_world_of_a_kept_trace_is_made_without_its_fmu(folder: Path, tmp_path: Path) -> None:
    one = case({"lead": lead(driver(folder))})
    drive([one], tmp_path, 0)
    refused(SpecError, drive, [one], tmp_path, 1, says="is not there")


def test_another_file_than_planned_is_not_driven_with(folder: Path) -> None:
    other = driver(folder, digest="0" * 64)
    refused(SpecError, drive, [case({"lead": lead(other)})], folder, 1, says="another file than")


IMPOSSIBLE = {
    "v[3] = 50.1;": "its acceleration is 50.1 m/s²",
    "v[3] = -1e300;": "its acceleration is -1e+300 m/s²",
    "v[4] = 1e300;": "its speed aside is 1e+300 m/s",
    "v[3] = 50.0;": "its speed is 152 m/s",
    "v[4] = 15.0;": "across the road it is off its start by 50",
}


@pytest.mark.parametrize("step", IMPOSSIBLE)
def test_driver_that_leads_its_actor_out_of_the_world_has_failed(tmp_path: Path, step: str) -> None:
    echo(tmp_path, step)
    one = case({"lead": lead(driver(tmp_path))})
    refused(PluginError, drive, [one], tmp_path, 80, says=IMPOSSIBLE[step])


def test_actor_whose_driver_fails_ends_the_campaign(tmp_path: Path) -> None:
    echo(tmp_path, "if (t > 0.3) v[3] = NAN;")
    one = case({"lead": lead(driver(tmp_path))})
    error = refused(PluginError, drive, [one], tmp_path, says="actors.lead.driver './echo.fmu'")
    assert "failed at 0.35 s: invalid_output: acceleration nan (a)" in str(error)
    assert error.exit_code == 3


def test_unit_that_measures_something_else_is_refused(tmp_path: Path) -> None:
    echo(tmp_path, unit="m")
    wrong = Driver.model_validate(driver(tmp_path, inputs={"u": "own.speed"}))
    refused(SpecError, wire_driver, wrong, tmp_path, says="has the unit 'm'")


def test_signal_that_is_not_there_is_refused_with_a_near_one(folder: Path) -> None:
    wrong = driver(folder, inputs={"u": "own.sped"})
    refused(ValueError, Driver.model_validate, wrong, says=r"no signal 'own\.sped'.*own\.speed")


def test_one_thing_moves_an_actor(folder: Path) -> None:
    both = {**lead(driver(folder)), "reactive": {}}
    refused(ValueError, case, {"lead": both}, says="keep one of reactive and driver")
    event = {"actor": "lead", "when": "time >= 1 s", "speed": {"to": "0 m/s", "rate": "3 m/s^2"}}
    scenario = make_scenario(actors={"lead": lead(driver(folder))}, storyboard={"brake": event})
    found = [text for _, text in check_scenario(scenario)]
    assert any("'lead' is driven by an FMU and takes no actions" in text for text in found)


def test_the_file_counts_not_where_it_lies(tmp_path: Path) -> None:
    texts = {"one": "", "two": "", "other": "v[3] += 0.0;"}
    found = {}
    for name, step in texts.items():
        folder = tmp_path / name
        folder.mkdir()
        echo(folder, step)
        given = driver(folder)
        del given["digest"]
        content = merged(MOTORWAY, {"actors": {"lead": lead(given)}})
        write_yaml(folder / "driven.yaml", {**content, "scenario": "driven"})
        found[name] = load_scenario(folder / "driven.yaml").spec
    assert found["one"].drivers["lead"].digest == file_digest(tmp_path / "one" / "echo.fmu")
    digests = {name: content_digest(spec) for name, spec in found.items()}
    assert digests["one"] == digests["two"] != digests["other"]


def test_digest_that_is_given_is_held_against_the_file(folder: Path, tmp_path: Path) -> None:
    echo(tmp_path)
    content = merged(MOTORWAY, {"actors": {"lead": lead(driver(folder, digest="0" * 64))}})
    write_yaml(tmp_path / "driven.yaml", {**content, "scenario": "driven"})
    refused(SpecError, load_scenario, tmp_path / "driven.yaml", says="has sha256")


def test_scenario_without_drivers_is_identified_as_before(folder: Path) -> None:
    undriven = {k: v for k, v in lead(driver(folder)).items() if k != "driver"}
    one, other = (case({"lead": item}) for item in (undriven, lead(driver(folder))))
    assert "driver" not in one.scenario.actors["lead"].model_dump()
    assert structure_key(one) != structure_key(other)


def test_offset_counts_from_the_middle_of_the_lane(folder: Path) -> None:
    scenes = drive([case({"lead": lead(driver(folder, outputs=HELD))})], folder, 3)
    assert scenes[-1].object_places[0, 0, PLACE_OFFSET] == pytest.approx(0.0, abs=1e-9)
