"""Storyboards become rows of numbers and programs."""

from typing import Any

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.kernel.postfix import is_satisfied
from adeye.kernel.storyboard import (
    ACTION_ACTOR,
    ACTION_JERK,
    ACTION_KIND,
    ACTION_RATE,
    ACTION_SHAPE,
    ACTION_TARGET,
    CHANGE_BY,
    CHANGE_SPEED,
    CHANGE_TO,
    CROSS,
    LINEAR,
    SINUSOIDAL,
    Script,
)
from adeye.simulate.world.compile import check_lanes, compile_script
from adeye.simulate.world.formulas import Formulas
from adeye.simulate.world.roads import build_roads
from tests.motorway import make_case, make_scenario

ACTORS: dict[str, dict[str, Any]] = {
    name: {"kind": kind, "start": {"lane": 0, "s": "300 m", "speed": "20 m/s"}}
    for name, kind in (("one", "car"), ("two", "car"), ("walker", "pedestrian"))
}
INDEX = {"time": 0, "gap": 1, "ego_speed": 2}


def script(*boards: dict[str, Any], gaps: tuple[float, ...] = (40.0,)) -> Script:
    cases = []
    for board in boards:
        scenario = make_scenario(actors=ACTORS, storyboard=board)
        cases += [make_case(scenario, {"gap": gap}) for gap in gaps]
    formulas = Formulas.of(cases)
    return compile_script(formulas, build_roads(formulas), INDEX, 0.05)


def event(when: str = "time >= 1 s", *, actor: str = "two", **action: Any) -> dict[str, Any]:
    return {"actor": actor, "when": when, **action}


def test_a_lane_change_aims_at_the_centre_of_its_lane() -> None:
    change = {"to_lane": 2, "lateral_speed": "1.2 m/s"}
    row = script({"cut": event(lane_change=change)}).actions[0, 0]
    assert row[ACTION_KIND] == CHANGE_TO
    assert row[ACTION_ACTOR] == 1
    assert row[ACTION_TARGET] == pytest.approx(8.75)
    assert row[ACTION_RATE] == 1.2
    assert row[ACTION_SHAPE] == SINUSOIDAL


def test_a_lane_change_by_a_distance_varies_with_the_run() -> None:
    change = {"by": "gap / 20", "lateral_speed": "1 m/s", "shape": "linear"}
    rows = script({"swerve": event(lane_change=change)}, gaps=(40.0, 20.0)).actions[:, 0]
    assert rows[:, ACTION_TARGET].tolist() == [2.0, 1.0]
    assert set(rows[:, ACTION_KIND]) == {CHANGE_BY}
    assert set(rows[:, ACTION_SHAPE]) == {LINEAR}


def test_a_stop_is_a_change_to_no_speed_without_jerk_limit() -> None:
    row = script({"brake": event(stop={"rate": "6 m/s^2"})}).actions[0, 0]
    assert row[ACTION_KIND] == CHANGE_SPEED
    assert (row[ACTION_TARGET], row[ACTION_RATE], row[ACTION_JERK]) == (0.0, 6.0, np.inf)


def test_a_speed_change_and_a_crossing_keep_their_values() -> None:
    board = {
        "faster": event(speed={"to": "30 m/s", "rate": "2 m/s^2", "jerk": "4 m/s^3"}),
        "walk": event(actor="walker", cross={"to": "9 m", "speed": "1.5 m/s"}),
    }
    faster, walk = script(board).actions[0]
    assert (faster[ACTION_TARGET], faster[ACTION_RATE], faster[ACTION_JERK]) == (30.0, 2.0, 4.0)
    assert (walk[ACTION_KIND], walk[ACTION_TARGET], walk[ACTION_RATE]) == (CROSS, 9.0, 1.5)


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
