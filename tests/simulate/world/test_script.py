"""Storyboards become rows of numbers and programs."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.kernel import storyboard as k
from adeye.kernel.postfix import is_satisfied
from adeye.signals import Scene
from adeye.simulate.traffic.stage import locate_all
from adeye.simulate.world import storyboard as subject
from adeye.simulate.world.compile import compile_world
from adeye.simulate.world.formulas import Formulas
from adeye.simulate.world.roads import build_roads
from adeye.simulate.world.storyboard import check_lanes, compile_script
from adeye.spec.scenario import LogicalScenario
from adeye.sweep.case import TestCase
from adeye.units import Dimension
from tests.motorway import make_case, make_scenario

ACTORS: dict[str, dict[str, Any]] = {
    name: {"kind": kind, "start": {"lane": 0, "s": "300 m", "speed": "20 m/s"}}
    for name, kind in (("one", "car"), ("two", "car"), ("walker", "pedestrian"))
}
INDEX = {"time": 0, "gap": 1, "ego_speed": 2}


def script(*boards: dict[str, Any], gaps: tuple[float, ...] = (40.0,)) -> k.Script:
    cases = []
    for board in boards:
        scenario = make_scenario(actors=ACTORS, storyboard=board)
        cases += [make_case(scenario, {"gap": gap}) for gap in gaps]
    formulas = Formulas.of(cases)
    begins = {name: np.zeros(formulas.runs) for name in formulas.scenario.actors}
    return compile_script(formulas, build_roads(formulas), begins, INDEX, 0.05)


def event(when: str = "time >= 1 s", *, actor: str = "two", **action: Any) -> dict[str, Any]:
    return {"actor": actor, "when": when, **action}


def test_a_lane_change_aims_at_the_centre_of_its_lane() -> None:
    change = {"to_lane": 2, "lateral_speed": "1.2 m/s"}
    row = script({"cut": event(lane_change=change)}).actions[0, 0]
    assert row[k.ACTION_KIND] == k.CHANGE_TO
    assert row[k.ACTION_ACTOR] == 1
    assert row[k.ACTION_TARGET] == pytest.approx(8.75)
    assert row[k.ACTION_RATE] == 1.2
    assert row[k.ACTION_SHAPE] == k.SINUSOIDAL


def test_a_lane_change_by_a_distance_varies_with_the_run() -> None:
    change = {"by": "gap / 20", "lateral_speed": "1 m/s", "shape": "linear"}
    rows = script({"swerve": event(lane_change=change)}, gaps=(40.0, 20.0)).actions[:, 0]
    assert rows[:, k.ACTION_TARGET].tolist() == [2.0, 1.0]
    assert set(rows[:, k.ACTION_KIND]) == {k.CHANGE_BY}
    assert set(rows[:, k.ACTION_SHAPE]) == {k.LINEAR}


def test_a_stop_is_a_change_to_no_speed_without_jerk_limit() -> None:
    row = script({"brake": event(stop={"rate": "6 m/s^2"})}).actions[0, 0]
    assert row[k.ACTION_KIND] == k.CHANGE_SPEED
    assert (row[k.ACTION_TARGET], row[k.ACTION_RATE], row[k.ACTION_JERK]) == (0.0, 6.0, np.inf)


def test_a_speed_change_and_a_crossing_keep_their_values() -> None:
    board = {
        "faster": event(speed={"to": "30 m/s", "rate": "2 m/s^2", "jerk": "4 m/s^3"}),
        "walk": event(actor="walker", cross={"to": "9 m", "speed": "1.5 m/s"}),
    }
    faster, walk = script(board).actions[0]
    assert (faster[k.ACTION_TARGET], faster[k.ACTION_RATE], faster[k.ACTION_JERK]) == (
        30.0,
        2.0,
        4.0,
    )
    assert (walk[k.ACTION_KIND], walk[k.ACTION_TARGET], walk[k.ACTION_RATE]) == (k.CROSS, 9.0, 1.5)


def test_equal_conditions_share_a_program_and_overridden_ones_have_their_own() -> None:
    stop = {"rate": "6 m/s^2"}
    early = {"a": event(stop=stop), "b": event(stop=stop)}
    late = {"a": event(stop=stop), "b": event("time >= 3 s and gap < 50 m", stop=stop)}
    made = script(early, late)
    assert made.numbers.tolist() == [[0, 0], [0, 1]]
    variables = np.array([2.0, 40.0, 30.0])
    values = [bool(is_satisfied(made.programs, p, variables)) for p in (0, 1)]
    assert values == [True, False]


def test_an_empty_storyboard_has_no_programs() -> None:
    made = script({})
    assert made.actions.shape[1] == 0
    assert made.numbers.shape == (1, 0)


def test_an_impossible_action_is_an_error_with_its_field() -> None:
    impossible: list[tuple[dict[str, Any], str]] = [
        ({"lane_change": {"to_lane": 3, "lateral_speed": "1 m/s"}}, "to_lane: 3 is no lane"),
        ({"lane_change": {"by": "1 m", "lateral_speed": "0 m/s"}}, "lateral_speed: 0 m/s"),
        ({"stop": {"rate": "-3 m/s^2"}}, r"storyboard\.act\.stop\.rate: -3 m/s\^2"),
        ({"stop": {"rate": "3 m/s^2", "jerk": "0 m/s^3"}}, r"stop\.jerk: 0"),
        ({"speed": {"to": "-1 m/s", "rate": "3 m/s^2"}}, r"speed\.to: -1"),
        ({"actor": "walker", "cross": {"to": "3 m", "speed": "0 m/s"}}, r"cross\.speed: 0"),
    ]
    for action, message in impossible:
        with pytest.raises(SpecError, match=message):
            script({"act": event(**action)})


def test_only_whole_numbers_of_the_road_are_lanes() -> None:
    check_lanes("lane", np.array([0.0, 2.0]), 3)
    for lane in (-1.0, 0.5, 3.0, np.nan):
        with pytest.raises(SpecError, match="no lane"):
            check_lanes("lane", np.array([0.0, lane]), 3)


@pytest.mark.parametrize("kind", ["car", "cyclist"])
def test_what_has_wheels_does_not_turn_on_the_spot(
    monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    cross = {"go": event(cross={"to": "8 m", "speed": "1.4 m/s"})}
    monkeypatch.setitem(ACTORS["two"], "kind", kind)
    with pytest.raises(SpecError, match=r"storyboard\.go\.cross: two has wheels"):
        script(cross)
    start = {"lane": 0, "s": "300 m", "speed": "20 m/s", "heading": "60 deg"}
    monkeypatch.setitem(ACTORS["two"], "start", start)
    with pytest.raises(SpecError, match=r"actors\.two\.start\.heading: 60 deg is across"):
        script({"go": event(lane_change={"to_lane": 2, "lateral_speed": "1 m/s"})})


# --- Trigger variables: gaps and times to collision along the road, distances between bodies ------


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


def values_at(
    cases: list[TestCase], begun: Any = None, ended: Any = None, tick: int = 0
) -> dict[str, list[float]]:
    """Return the trigger variables of test cases where they begin, by name and run."""
    world, runs = compile_world(cases), len(cases)
    places = np.zeros((runs, 6)), np.zeros((runs, len(world.objects[0]), 6))
    grounds, whole = world.context.road.grounds(), np.ones(runs, dtype=np.bool_)
    near = np.zeros((runs, 1 + world.objects.shape[1]), dtype=np.int64)
    locate_all(whole, world.ego, world.objects, grounds, np.zeros((runs, 0, 6)), near, *places)
    events = len(cases[0].scenario.storyboard)
    scene = Scene(
        tick=tick,
        time=0.05 * tick,
        ego=world.ego,
        ego_place=places[0],
        objects=world.objects,
        object_places=places[1],
        begun=np.zeros((runs, events)) if begun is None else np.array(begun),
        ended=np.zeros((runs, events), dtype=np.bool_) if ended is None else np.array(ended),
        contact=np.full(runs, -1),
        impact_speed=np.zeros(runs),
        foreign_contact=~whole,
        running=whole,
    )
    table = subject.TriggerTable.of(cases, world.context)
    return dict(zip(table.index, table.values(scene).T.tolist(), strict=True))


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


def test_values_are_those_of_the_scene(scenario: LogicalScenario) -> None:
    cases = [make_case(scenario, {"gap": gap, "rain": 5e-7, "share": 0.5}) for gap in (40.0, 20.0)]
    found = values_at(cases, [[np.nan], [0.25]], [[False], [True]], 10)
    for name, expected in VALUES.items():
        assert found[name] == pytest.approx(expected, nan_ok=True), name


def at_start(case: TestCase) -> dict[str, float]:
    """Return the trigger variables of a test case as it begins."""
    return {name: value for name, (value,) in values_at([case]).items()}


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
