"""Findings name the place in the file, what is wrong and what is there instead."""

from collections.abc import Callable
from typing import Any

import pytest

from adeye.simulate.world.check import check_purpose, check_scenario
from adeye.spec.scenario import LogicalScenario

Make = Callable[..., LogicalScenario]


def car(**start: Any) -> dict[str, Any]:
    return {"kind": "car", "start": {"lane": 1, "s": "300 m", "speed": "20 m/s", **start}}


def event(when: str = "time > 1 s", actor: str = "lead", **action: Any) -> dict[str, Any]:
    return {"actor": actor, "when": when, **(action or {"stop": {"rate": "3 m/s^2"}})}


def test_a_sound_scenario_has_no_findings(make_scenario: Make) -> None:
    scenario = make_scenario(
        actors={"lead": car(), "other": car(s=None, ahead_of="lead", gap="gap / 2")},
        storyboard={
            "brake": event("lead.ttc < 3 s or lead.gap < gap / 2"),
            "cut": event(
                "brake.begun and time > 2 s and other.distance < 40 m",
                actor="other",
                lane_change={"to_lane": 0, "lateral_speed": "1 m/s"},
            ),
        },
        realised=["cut"],
        constraints=["ego_speed > 10 km/h"],
    )
    assert check_scenario(scenario) == []


@pytest.mark.parametrize(
    ("changes", "loc", "message"),
    [
        ({"ego": {"speed": "ego_sped"}}, ("ego", "speed"), "Did you mean 'ego_speed'"),
        ({"ego": {"s": "ego_speed"}}, ("ego", "s"), "is a speed, not a length"),
        ({"ego": {"offset": "gap + 3 s"}}, ("ego", "offset"), "puts a length and a time together"),
        (
            {"world": {"road": {"lane_width": "ego_speed"}}},
            ("world", "road", "lane_width"),
            "is a speed, not a length",
        ),
        ({"actors": {"lead": car(heading="gap")}}, ("actors", "lead", "start", "heading"), "angle"),
        ({"environment": {"friction": "gap"}}, ("environment", "friction"), "plain number"),
        ({"constraints": ["gap > 3 s"]}, ("constraints", 0), "a length and a time together"),
        ({"constraints": ["lead.gap > 3 m"]}, ("constraints", 0), "does not exist"),
        ({"realised": ["cut"]}, ("realised", 0), "there is no event 'cut'"),
        (
            {"storyboard": {"brake": event(actor="leed")}, "actors": {"lead": car()}},
            ("storyboard", "brake", "actor"),
            "Did you mean 'lead'",
        ),
        (
            {"storyboard": {"brake": event()}, "actors": {"lead": {**car(), "reactive": {}}}},
            ("storyboard", "brake", "actor"),
            "'lead' is reactive",
        ),
        (
            {"storyboard": {"brake": event("lead.tcc < 3 s")}, "actors": {"lead": car()}},
            ("storyboard", "brake", "when"),
            "Did you mean 'lead.ttc'",
        ),
        (
            {"storyboard": {"brake": event("lead.ttc < 3 m")}, "actors": {"lead": car()}},
            ("storyboard", "brake", "when"),
            "a time and a length together",
        ),
        (
            {"storyboard": {"brake": event("not ego.speed")}, "actors": {"lead": car()}},
            ("storyboard", "brake", "when"),
            "a speed is taken for true or false",
        ),
        (
            {"storyboard": {"brake": event("time == 'late'")}, "actors": {"lead": car()}},
            ("storyboard", "brake", "when"),
            "uses text",
        ),
        (
            {
                "storyboard": {"cut": event(lane_change={"to_lane": 3, "lateral_speed": "1 m/s"})},
                "actors": {"lead": car()},
            },
            ("storyboard", "cut", "lane_change", "to_lane"),
            "3 is no lane of a road with lanes 0 to 2",
        ),
        ({"ego": {"lane": -1}}, ("ego", "lane"), "-1 is no lane"),
        (
            {"actors": {"lead": car(s=None, ahead_of="nobody", gap="3 m")}},
            ("actors", "lead", "start", "ahead_of"),
            "there is no actor 'nobody'",
        ),
        (
            {
                "actors": {
                    "a": car(s=None, ahead_of="b", gap="3 m"),
                    "b": car(s=None, ahead_of="a", gap="3 m"),
                }
            },
            ("actors", "a", "start", "ahead_of"),
            "circle: a → b → a",
        ),
        ({"actors": {"ego": car()}}, ("actors", "ego"), "cannot name an actor"),
        (
            {"actors": {"idm": {**car(lane=None, offset="3 m"), "reactive": {}}}},
            ("actors", "idm", "start"),
            "starts in a lane",
        ),
        (
            {"actors": {"idm": {**car(heading="180 deg"), "reactive": {}}}},
            ("actors", "idm", "start", "heading"),
            "along the road",
        ),
        ({"parameters": {"time": {"default": "1 s"}}}, ("parameters", "time"), "cannot name"),
        ({"ego": {"s": "'far'"}}, ("ego", "s"), "uses text"),
    ],
)
def test_a_flaw_is_found_at_its_place(
    make_scenario: Make, changes: dict[str, Any], loc: tuple[str | int, ...], message: str
) -> None:
    findings = check_scenario(make_scenario(**changes))
    assert [place for place, _ in findings] == [loc]
    assert message in findings[0][1]


def test_every_finding_is_listed(make_scenario: Make) -> None:
    scenario = make_scenario(ego={"s": "ego_speed", "speed": "gap", "lane": 7})
    assert [loc for loc, _ in check_scenario(scenario)] == [
        ("ego", "s"),
        ("ego", "speed"),
        ("ego", "lane"),
    ]


def test_an_actor_and_an_object_of_one_name_are_refused(make_scenario: Make) -> None:
    wall = {
        "kind": "barrier",
        "s": "1 m",
        "offset": "1 m",
        "length": "1 m",
        "width": "1 m",
        "height": "1 m",
    }
    scenario = make_scenario(actors={"lead": car()}, world={"objects": {"lead": wall}})
    assert check_scenario(scenario) == [(("actors", "lead"), "'lead' is a static object as well")]


def test_event_that_need_not_begin_says_so(make_scenario: Make) -> None:
    sound = {"actors": {"lead": car()}, "storyboard": {"brake": event()}}
    purposes = [loc for loc, _ in check_purpose(make_scenario(**sound))]
    assert ("storyboard", "brake") in purposes
    optional = {**sound, "storyboard": {"brake": {**event(), "optional": True}}}
    for fine in ({**sound, "realised": ["brake"]}, optional):
        found = [loc for loc, _ in check_purpose(make_scenario(**fine))]
        assert ("storyboard", "brake") not in found
    both = check_purpose(make_scenario(**optional, realised=["brake"]))
    assert "Take one of them away" in dict(both)["storyboard", "brake"]


def test_word_about_an_event_is_no_part_of_a_run(make_scenario: Make) -> None:
    plain = make_scenario(actors={"lead": car()}, storyboard={"brake": event()})
    said = {"brake": {**event(), "optional": True}}
    assert plain.executable() == (
        make_scenario(actors={"lead": car()}, storyboard=said).executable()
    )
    assert "optional" not in plain.model_dump_json()


def test_parameter_that_only_a_constraint_names_is_used_by_nothing(make_scenario: Make) -> None:
    scenario = make_scenario(
        parameters={
            "gap": {"default": "30 m"},
            "shade": {"default": 1},
            "ego_speed": {"default": "9 m/s"},
        },
        actors={"lead": car(s="100 m + gap")},
        ego={"speed": "ego_speed"},
        constraints=["shade < 3"],
    )
    assert [loc for loc, _ in check_purpose(scenario)] == [("parameters", "shade")]


def test_an_event_whose_place_another_always_takes_is_found(make_scenario: Make) -> None:
    def event(when: str, **action: Any) -> dict[str, Any]:
        return {"actor": "lead", "when": when, "optional": True, **action}

    def found(*events: dict[str, Any]) -> list[Any]:
        lead = {"kind": "car", "start": {"lane": 1, "s": "300 m", "speed": "20 m/s"}}
        board = {f"e{number}": item for number, item in enumerate(events)}
        scenario = make_scenario(actors={"lead": lead}, storyboard=board)
        return [loc for loc, _ in check_purpose(scenario) if loc[0] == "storyboard"]

    stop = {"stop": {"rate": "3 m/s^2"}}
    change = {"lane_change": {"to_lane": 2, "lateral_speed": "1 m/s"}}
    assert found(event("time >= 0.5 s", **stop), event("time >= 500 ms", **stop)) == [
        ("storyboard", "e0")
    ]
    assert found(event("time >= 0.5 s", **stop), event("time >= 0.5 s", **change)) == []
    assert found(event("time >= 0.5 s", **stop), event("time >= 0.6 s", **stop)) == []
    late = {"delay": "1 s", **stop}
    assert found(event("time >= 0.5 s", **stop), event("time >= 0.5 s", **late)) == []
