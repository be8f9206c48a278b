"""A batch of test cases becomes arrays, each run as if it were alone."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.kernel.motion import advance_ego
from adeye.kernel.road import local
from adeye.kernel.storyboard import PACE, D, S
from adeye.signals import ILLUMINANCE, OBJECT_CLASSES
from adeye.simulate.world.compile import compile_world, ego_desired_speeds
from tests.motorway import make_case, make_scenario

ACTORS: dict[str, Any] = {
    "lead": {
        "kind": "truck",
        "start": {"lane": 1, "speed": "22 m/s", "ahead_of": "ego", "gap": "gap"},
    },
    "rear": {
        "kind": "car",
        "start": {"lane": 2, "speed": "25 m/s", "s": "100 m"},
        "reactive": {"desired_speed": "ego_speed + 2 m/s", "lane_changes": True},
    },
}
WALL: dict[str, Any] = {
    "kind": "barrier",
    "s": "400 m",
    "offset": "-2 m",
    "heading": "10 deg",
    "length": "10 m",
    "width": "0.5 m",
    "height": "1 m",
}


def test_actors_come_first_and_static_objects_after_them() -> None:
    scenario = make_scenario(actors=ACTORS, world={"objects": {"wall": WALL}})
    world = compile_world([make_case(scenario)])
    context = world.context
    assert context.object_ids == ("lead", "rear", "wall")
    assert context.actor_count == 2
    assert [OBJECT_CLASSES[k] for k in context.object_classes] == ["truck", "car", "barrier"]
    assert world.objects[0, 2].tolist() == pytest.approx([400.0, -2.0, math.radians(10), 0.0, 0.0])
    assert world.scripted.tolist() == [True, False]
    assert world.lane_changes.tolist() == [False, True]
    assert world.desired_speed[0].tolist() == [22.0, 32.0]


def test_sizes_and_seeds_belong_to_their_run() -> None:
    scenario = make_scenario()
    cases = [make_case(scenario, {"gap": gap}) for gap in (40.0, 41.0)]
    wide = make_case(scenario, vehicle={"width": "2.1 m"})
    context = compile_world([*cases, wide]).context
    assert context.ego_size[:, 1].tolist() == [1.9, 1.9, 2.1]
    assert context.stream_seeds.dtype == np.uint64
    assert len(set(context.stream_seeds.tolist())) == 2
    assert context.stream_seeds[0] == context.stream_seeds[2]


def test_the_initial_actor_rows_agree_with_the_scene() -> None:
    world = compile_world([make_case(make_scenario(actors=ACTORS))])
    row = world.actors[0, 0]
    assert row[S] == pytest.approx(200.0 + 2.4 + 40.0 + 6.0)
    assert (row[D], row[PACE]) == (5.25, 22.0)
    assert world.objects[0, 0, :2].tolist() == pytest.approx([row[S], row[D]])


def test_without_a_goal_it_is_never_reached() -> None:
    plain = compile_world([make_case(make_scenario())])
    ahead = compile_world([make_case(make_scenario(ego={"goal": {"s": "10 * gap"}}))])
    assert plain.goal.tolist() == [math.inf]
    assert ahead.goal.tolist() == [400.0]


def test_a_goal_that_is_there_at_once_is_refused() -> None:
    def ahead(metres: float) -> Any:
        ego = {"s": "200 m", "speed": "20 m/s", "goal": {"s": f"{200.0 + metres} m"}}
        return compile_world([make_case(make_scenario(ego=ego))]).goal.tolist()

    assert ahead(20.0) == [220.0]
    for metres in (0.01, 19.9):
        with pytest.raises(SpecError, match=r"ego\.goal\.s: .* is less than 1 s of driving"):
            ahead(metres)


def test_a_goal_that_is_not_ahead_on_the_road_is_refused() -> None:
    # The ego starts at 200 m; the road has 2000 m.
    for goal in ("50 m", "200 m", "2001 m", "5 * gap"):
        case = make_case(make_scenario(ego={"goal": {"s": goal}}))
        with pytest.raises(SpecError, match=r"ego\.goal\.s: \d+ m is not on the way from the st"):
            compile_world([case])


def test_the_desired_speed_of_the_ego_defaults_to_its_first() -> None:
    plain, eager = make_scenario(), make_scenario(ego={"desired_speed": "ego_speed + 3 m/s"})
    assert ego_desired_speeds([make_case(plain), make_case(eager)]).tolist() == [30.0, 33.0]


def test_surroundings_are_in_si() -> None:
    scenario = make_scenario(environment={"rain": "7.5 mm/h", "illumination": "night"})
    around = compile_world([make_case(scenario)]).context.surroundings
    assert around.rain[0] == pytest.approx(7.5e-3 / 3600)
    assert around.night.tolist() == [True]
    assert around.fog_visibility.tolist() == [2000.0]


def test_illumination_becomes_an_illuminance() -> None:
    for light, illuminance in ILLUMINANCE.items():
        scenario = make_scenario(environment={"illumination": light})
        around = compile_world([make_case(scenario)]).context.surroundings
        assert around.illuminance.tolist() == [illuminance]
        assert around.night.tolist() == [light in {"lit_night", "night"}]
        assert np.isnan(around.sun_elevation).all()


def test_sun_is_a_formula_of_the_parameters() -> None:
    sun = {"sun_elevation": "gap / 1 m * 1 deg", "sun_azimuth": "-90 deg"}
    scenario = make_scenario(environment=sun)
    cases = [make_case(scenario, {"gap": gap}) for gap in (40.0, 5.0)]
    around = compile_world(cases).context.surroundings
    assert np.degrees(around.sun_elevation).tolist() == pytest.approx([40.0, 5.0])
    assert np.degrees(around.sun_azimuth).tolist() == pytest.approx([-90.0, -90.0])


def test_sun_goes_with_the_day_and_below_the_horizon_with_the_dark() -> None:
    for environment, said in (
        ({"sun_elevation": "91 deg"}, "91 deg is beyond the zenith"),
        ({"sun_elevation": "5 deg", "illumination": "night"}, "the illumination is not day"),
        ({"sun_elevation": "5 deg", "illumination": "dusk"}, "the illumination is not day"),
        ({"sun_elevation": "-5 deg"}, "down, but the illumination is day"),
    ):
        with pytest.raises(SpecError, match=said):
            compile_world([make_case(make_scenario(environment=environment))])
    scenario = make_scenario(environment={"sun_elevation": "-5 deg", "illumination": "dusk"})
    assert compile_world([make_case(scenario)]).context.surroundings.sun_elevation[0] < 0.0


@pytest.mark.slow
@pytest.mark.parametrize("radius", ["300 m", "-300 m"])
def test_an_ego_that_starts_in_a_curve_stays_in_its_lane_with_its_wheels_held(radius: str) -> None:
    scenario = make_scenario(
        world={"road": {"kind": "curve", "length": "800 m", "radius": radius}},
        ego={"speed": "20 m/s"},
    )
    world = compile_world([make_case(scenario)])
    state = world.ego[0].copy()
    for _ in range(200):
        advance_ego(state, 0.0, state[5], 0.05, 2.9, 1.45, 3, 9, 0.6, 0.8, 0.2, 0.1, 0.9, state)
    s, d, _, _ = local(world.context.road.segments[0], state[0], state[1])
    assert s > 390.0
    assert d == pytest.approx(5.25, abs=1e-6)


def test_a_run_does_not_depend_on_its_batch() -> None:
    scenario = make_scenario(
        actors=ACTORS, world={"road": {"kind": "s_curve", "radius": "20 * gap"}}
    )
    cases = [make_case(scenario, {"gap": gap}) for gap in np.linspace(35.0, 60.0, 7)]
    together = compile_world(cases)
    for run, case in enumerate(cases):
        alone = compile_world([case])
        for name in ("ego", "objects", "actors"):
            assert getattr(alone, name)[0].tolist() == getattr(together, name)[run].tolist()


def test_test_cases_of_different_steps_do_not_share_a_batch() -> None:
    scenario = make_scenario()
    with pytest.raises(SpecError, match="one step"):
        compile_world([make_case(scenario), make_case(scenario, step=0.1)])


def test_a_negative_desired_speed_is_refused() -> None:
    actors = {"rear": {**ACTORS["rear"], "reactive": {"desired_speed": "ego_speed - 40 m/s"}}}
    with pytest.raises(SpecError, match="desired speed is negative"):
        compile_world([make_case(make_scenario(actors=actors))])
