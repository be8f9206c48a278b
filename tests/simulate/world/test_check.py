"""Findings name the place in the file, what is wrong and what is there instead."""

from typing import Any

from adeye.simulate.world.check import check_purpose, check_scenario
from tests.motorway import make_scenario


def car(**start: Any) -> dict[str, Any]:
    return {"kind": "car", "start": {"lane": 1, "s": "300 m", "speed": "20 m/s", **start}}


def event(when: str = "time > 1 s", actor: str = "lead", **action: Any) -> dict[str, Any]:
    return {"actor": actor, "when": when, **(action or {"stop": {"rate": "3 m/s^2"}})}


def test_a_sound_scenario_has_no_findings() -> None:
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


def lead(start: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    """Return changes of a scenario to one actor."""
    return {"actors": {"lead": {**car(**(start or {})), **more}}}


def braking(**changes: Any) -> dict[str, Any]:
    """Return changes of a scenario to one actor with one event."""
    return {"storyboard": {"brake": event(**changes)}, **lead()}


CHANGE = {"lane_change": {"to_lane": 3, "lateral_speed": "1 m/s"}}
CIRCLE = {
    "a": car(s=None, ahead_of="b", gap="3 m"),
    "b": car(s=None, ahead_of="a", gap="3 m"),
}
FLAWS: list[tuple[dict[str, Any], str, str]] = [
    ({"ego": {"speed": "ego_sped"}}, "ego.speed", "Did you mean 'ego_speed'"),
    ({"ego": {"s": "ego_speed"}}, "ego.s", "is a speed, not a length"),
    ({"ego": {"s": "'far'"}}, "ego.s", "uses text"),
    ({"ego": {"offset": "gap + 3 s"}}, "ego.offset", "puts a length and a time together"),
    ({"ego": {"lane": -1}}, "ego.lane", "-1 is no lane"),
    (
        {"world": {"road": {"lane_width": "ego_speed"}}},
        "world.road.lane_width",
        "is a speed, not a",
    ),
    ({"environment": {"friction": "gap"}}, "environment.friction", "plain number"),
    ({"constraints": ["gap > 3 s"]}, "constraints.0", "a length and a time together"),
    ({"constraints": ["lead.gap > 3 m"]}, "constraints.0", "does not exist"),
    ({"realised": ["cut"]}, "realised.0", "there is no event 'cut'"),
    ({"parameters": {"time": {"default": "1 s"}}}, "parameters.time", "cannot name"),
    (lead({"heading": "gap"}), "actors.lead.start.heading", "angle"),
    ({"actors": {"ego": car()}}, "actors.ego", "cannot name an actor"),
    ({"actors": CIRCLE}, "actors.a.start.ahead_of", "circle: a → b → a"),
    (
        lead({"s": None, "ahead_of": "nobody", "gap": "3 m"}),
        "actors.lead.start.ahead_of",
        "there is no actor 'nobody'",
    ),
    (lead({"lane": None, "offset": "3 m"}, reactive={}), "actors.lead.start", "starts in a lane"),
    (lead({"heading": "180 deg"}, reactive={}), "actors.lead.start.heading", "along the road"),
    (braking() | lead(reactive={}), "storyboard.brake.actor", "'lead' is reactive"),
    (braking(actor="leed"), "storyboard.brake.actor", "Did you mean 'lead'"),
    (braking(when="lead.tcc < 3 s"), "storyboard.brake.when", "Did you mean 'lead.ttc'"),
    (braking(when="lead.ttc < 3 m"), "storyboard.brake.when", "a time and a length together"),
    (braking(when="not ego.speed"), "storyboard.brake.when", "a speed is taken for true or false"),
    (braking(when="time == 'late'"), "storyboard.brake.when", "uses text"),
    (
        braking(**CHANGE),
        "storyboard.brake.lane_change.to_lane",
        "3 is no lane of a road with lanes 0",
    ),
]


def test_a_flaw_is_found_at_its_place() -> None:
    for changes, loc, message in FLAWS:
        findings = check_scenario(make_scenario(**changes))
        assert [".".join(map(str, place)) for place, _ in findings] == [loc], message
        assert message in findings[0][1]


def test_every_finding_is_listed() -> None:
    scenario = make_scenario(ego={"s": "ego_speed", "speed": "gap", "lane": 7})
    found = [loc for loc, _ in check_scenario(scenario)]
    assert found == [("ego", "s"), ("ego", "speed"), ("ego", "lane")]


def test_an_actor_and_an_object_of_one_name_are_refused() -> None:
    size = {"length": "1 m", "width": "1 m", "height": "1 m"}
    wall = {"kind": "barrier", "s": "1 m", "offset": "1 m", **size}
    scenario = make_scenario(actors={"lead": car()}, world={"objects": {"lead": wall}})
    assert check_scenario(scenario) == [(("actors", "lead"), "'lead' is a static object as well")]


def test_event_that_need_not_begin_says_so() -> None:
    sound = {"actors": {"lead": car()}, "storyboard": {"brake": event()}}
    purposes = [loc for loc, _ in check_purpose(make_scenario(**sound))]
    assert ("storyboard", "brake") in purposes
    optional = {**sound, "storyboard": {"brake": {**event(), "optional": True}}}
    for fine in ({**sound, "realised": ["brake"]}, optional):
        found = [loc for loc, _ in check_purpose(make_scenario(**fine))]
        assert ("storyboard", "brake") not in found
    both = check_purpose(make_scenario(**optional, realised=["brake"]))
    assert "Take one of them away" in dict(both)["storyboard", "brake"]


def test_word_about_an_event_is_no_part_of_a_run() -> None:
    plain = make_scenario(actors={"lead": car()}, storyboard={"brake": event()})
    said = {"brake": {**event(), "optional": True}}
    assert plain.executable() == (
        make_scenario(actors={"lead": car()}, storyboard=said).executable()
    )
    assert "optional" not in plain.model_dump_json()


def test_parameter_that_only_a_constraint_names_is_used_by_nothing() -> None:
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


def test_an_event_whose_place_another_always_takes_is_found() -> None:
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
