"""Trigger variables: gaps and times to collision along the road, distances between bodies."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.signals import Scene
from adeye.simulate.traffic.stage import locate_all
from adeye.simulate.world import compile as subject
from adeye.simulate.world.compile import compile_world
from adeye.spec.scenario import LogicalScenario
from adeye.sweep.case import TestCase
from adeye.units import Dimension
from tests.motorway import make_case, make_scenario


def actor(kind: str = "car", **start: Any) -> dict[str, Any]:
    return {"kind": kind, "start": {"lane": 1, "speed": "20 m/s", **start}}


@pytest.fixture
def scenario() -> LogicalScenario:
    return make_scenario(
        parameters={"rain": {"default": "2 mm/h"}, "share": {"default": 0.5}},
        actors={
            "lead": actor(ahead_of="ego", gap="gap"),
            "rear": {**actor(ahead_of="ego", gap="-10 m"), "kind": "truck"},
            "beside": actor(s="200 m", lane=2),
        },
        storyboard={"brake": {"actor": "lead", "when": "time > 1 s", "stop": {"rate": "3 m/s^2"}}},
    )


@pytest.fixture
def table(scenario: LogicalScenario) -> Any:
    cases = [make_case(scenario, {"gap": gap, "rain": 5e-7, "share": 0.5}) for gap in (40.0, 20.0)]
    world = compile_world(cases)
    places = np.zeros((2, 3, 6))
    places[:, :, 0] = world.objects[:, :, 0]
    places[:, :, 1] = world.objects[:, :, 1]
    ego_place = np.zeros((2, 6))
    ego_place[:, :2] = world.ego[:, :2]
    scene = Scene(
        tick=10,
        time=0.5,
        ego=world.ego,
        ego_place=ego_place,
        objects=world.objects,
        object_places=places,
        begun=np.array([[np.nan], [0.25]]),
        ended=np.array([[False], [True]]),
        contact=np.full(2, -1),
        impact_speed=np.zeros(2),
        foreign_contact=np.zeros(2, dtype=np.bool_),
        running=np.ones(2, dtype=np.bool_),
    )
    made = subject.TriggerTable.of(cases, world.context)
    values = made.values(scene)
    return lambda name: values[:, made.index[name]].tolist()


def test_the_columns_are_the_names_that_conditions_may_use(scenario: LogicalScenario) -> None:
    case = make_case(scenario, {"rain": 0.0, "share": 0.5})
    index = compile_world([case]).triggers.index
    assert list(index) == list(subject.trigger_variables(scenario))
    assert list(index.values()) == list(range(len(index)))


def test_dimensions_of_parameters_come_from_their_defaults(scenario: LogicalScenario) -> None:
    dimensions = subject.parameter_dimensions(scenario)
    assert dimensions["gap"] is Dimension.LENGTH
    assert dimensions["share"] is Dimension.NONE
    assert dimensions["rain"].exponents == Dimension.RAIN_RATE.exponents
    variables = subject.trigger_variables(scenario)
    assert variables["lead.ttc"] is Dimension.TIME
    assert variables["brake.begun"] is Dimension.NONE


VALUES = {
    # The gap and the distance to a car ahead in the lane agree.
    "lead.gap": [40.0, 20.0],
    "lead.distance": [40.0, 20.0],
    "lead.ttc": [4.0, 2.0],
    "lead.speed": [20.0, 20.0],
    "lead.d": [5.25, 5.25],
    # What is behind has a negative gap and does not close when it is slower.
    "rear.gap": [-10.0, -10.0],
    "rear.ttc": [math.inf, math.inf],
    "beside.gap": [0.0, 0.0],
    "beside.distance": [3.5 - 0.95 - 0.9] * 2,
    "time": [0.5, 0.5],
    "ego.speed": [30.0, 30.0],
    "ego.s": [200.0, 200.0],
    "ego.d": [5.25, 5.25],
    "brake.begun": [0.0, 1.0],
    "brake.ended": [0.0, 1.0],
    "brake.begun_at": [math.nan, 0.25],
    "brake.since": [math.nan, 0.25],
    "gap": [40.0, 20.0],
}


def test_values_are_those_of_the_scene(table: Any) -> None:
    for name, expected in VALUES.items():
        assert table(name) == pytest.approx(expected, nan_ok=True), name


def test_a_faster_one_behind_closes() -> None:
    assert subject.road_ttc(-10.0, 20.0, 25.0) == 2.0
    assert subject.road_ttc(-10.0, 20.0, 20.0) == math.inf
    assert subject.road_ttc(10.0, 0.0, 0.0) == math.inf
    assert subject.road_ttc(10.0, 20.0, -5.0) == 0.4


def test_a_gap_has_the_sign_of_where_the_other_is() -> None:
    assert subject.road_gap(10.0, 2.0, 3.0) == 5.0
    assert subject.road_gap(-10.0, 2.0, 3.0) == -5.0
    assert subject.road_gap(4.0, 2.0, 3.0) == 0.0


def at_start(case: TestCase) -> dict[str, float]:
    """Return the trigger variables of a test case as it begins."""
    world = compile_world([case])
    places = [np.zeros((1, 6)), np.zeros((1, 2, 6))]
    road = world.context.road
    locate_all(
        np.ones(1, bool), world.ego, world.objects, road.segments, road.lane_width, road.lanes,
        *places,
    )  # fmt: skip
    table = subject.TriggerTable.of([case], world.context)
    values = table.values(
        Scene(
            tick=0, time=0.0, ego=world.ego, ego_place=places[0], objects=world.objects,
            object_places=places[1], begun=np.zeros((1, 0)), ended=np.zeros((1, 0), bool),
            contact=np.array([-1]), impact_speed=np.zeros(1),
            foreign_contact=np.zeros(1, bool), running=np.ones(1, bool),
        )
    )[0]  # fmt: skip
    return dict(zip(table.index, values.tolist(), strict=True))


@pytest.mark.parametrize("radius", ["60 m", "-60 m"])
@pytest.mark.parametrize("lane", [0, 2])
def test_a_gap_on_a_bend_is_the_one_that_the_scenario_says(radius: str, lane: int) -> None:
    scenario = make_scenario(
        world={"road": {"kind": "curve", "radius": radius, "length": "250 m"}},
        ego={"lane": lane, "s": "120 m"},
        actors={
            "lead": actor(ahead_of="ego", gap="gap", lane=lane, speed="10 m/s"),
            "rear": actor(ahead_of="ego", gap="-8 m", lane=lane, speed="40 m/s"),
        },
    )
    values = at_start(make_case(scenario, {"gap": 40.0}))
    # The body of the ego is turned into the bend, which takes a little more of the road.
    assert values["lead.gap"] == pytest.approx(40.0, abs=0.03)
    assert values["rear.gap"] == pytest.approx(-8.0, abs=0.03)
    assert values["lead.ttc"] == pytest.approx(2.0, rel=1e-2)


@pytest.mark.parametrize(("radius", "bend"), [("60 m", 60.0), ("-60 m", -60.0)])
@pytest.mark.parametrize(("lane", "other"), [(0, 1), (1, 0), (0, 2), (2, 1)])
def test_on_a_bend_a_time_to_collision_is_the_gap_over_its_rate(
    radius: str, bend: float, lane: int, other: int
) -> None:
    scenario = make_scenario(
        world={"road": {"kind": "curve", "radius": radius, "length": "250 m"}},
        ego={"lane": lane, "s": "120 m"},
        actors={"lead": actor(ahead_of="ego", gap="gap", lane=other, speed="20 m/s")},
    )
    values = at_start(make_case(scenario, {"gap": 30.0}))
    own, beside = (bend - values[f"{who}.d"] for who in ("ego", "lead"))
    # The other turns about the centre of the bend with its speed over its own radius.
    closing = values["ego.speed"] - 20.0 * own / beside
    assert values["lead.ttc"] == pytest.approx(values["lead.gap"] / closing, rel=1e-2)


def test_a_box_across_the_road_takes_its_width_along_it() -> None:
    size = np.array([12.0, 2.5, 3.8])
    assert subject.road_extent(size, 0.0) == 6.0
    assert subject.road_extent(size, math.pi / 2) == pytest.approx(1.25)
    assert subject.road_extent(size, math.pi) == pytest.approx(6.0)
