"""Logical scenarios: what belongs together is asked for, and identity is what is executed."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.document import load_document
from adeye.spec.load import load_scenario
from adeye.spec.quantity import SI
from adeye.spec.scenario import LaneChange, LogicalScenario, Parameter, SpeedChange
from tests.stored import stored

TABLES = stored("definitions")


ROOT = Path(__file__).parents[2] / "scenarios_db"
SHIPPED = sorted(ROOT.rglob("*.yaml"))
BAY = {"kind": "parking_bay", "s": "400 m", "length": "60 m", "depth": "4 m", "taper": "20 m"}

CONTENT: dict[str, Any] = load_document(ROOT / "motorway" / "cut_in.yaml").value


def content(*place: str, value: Any) -> dict[str, Any]:
    """Return the shipped cut-in with one value changed; None removes it."""
    changed = copy.deepcopy(CONTENT)
    part = changed
    for key in place[:-1]:
        part = part.setdefault(key, {})
    if value is None:
        part.pop(place[-1], None)
    else:
        part[place[-1]] = value
    return changed


@pytest.mark.parametrize("path", SHIPPED, ids=[path.stem for path in SHIPPED])
def test_shipped_scenario_reads_back_from_its_stored_form(path: Path) -> None:
    spec = load_scenario(path).spec
    assert spec.scenario == path.stem
    assert LogicalScenario.model_validate(spec.model_dump(mode="json"), context=SI) == spec


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        (("world", "road", "kind"), "curve", "a curve road takes a radius"),
        (("world", "road", "radius"), "400 m", "a straight road takes no radius"),
        (("world", "road", "lanes"), 0, "greater than or equal to 1"),
        (("world", "road", "lanes"), 2.0, "valid integer"),
        (("world", "road", "lane_width"), "3.5 s", "is a time, not a length"),
        (("world", "road", "lane_width"), 3.5, "is a plain number, not a length"),
        (("environment", "rain"), "7 mm", "is a length, not a rain rate|is a length, not a speed"),
        (("environment", "illumination"), "noon", "'day', 'dusk'"),
        (("actors", "cutter", "start", "gap"), None, "ahead_of and gap go together"),
        (("actors", "cutter", "start", "s"), "200 m", "give either s or ahead_of with gap"),
        (("actors", "cutter", "start", "lane"), None, "give a lane, or an offset"),
        (("actors", "cutter", "kind"), "tank", "Input should be 'car'"),
        (("storyboard", "cut_in", "when"), "cutter.gap", "neither true nor false"),
        (("storyboard", "cut_in", "when"), True, "is not an expression"),
        (("storyboard", "cut_in", "stop"), {"rate": "3 m/s^2"}, "exactly one of"),
        (("storyboard", "cut_in", "lane_change"), None, "exactly one of"),
        (("storyboard", "cut_in", "lane_change", "by"), "3 m", "to_lane"),
        (("storyboard", "cut_in", "lane_change", "to_lane"), None, "to_lane"),
        (("horizon",), "0 s", "greater than 0"),
        (("horizon",), "12 m", "is not a time"),
        (("tail",), "-1 s", "greater than or equal to 0"),
        (("constraints",), ["gap"], "neither true nor false"),
        (("parameters", "Gap"), {"default": "1 m"}, "pattern"),
        (("provenance",), None, "Field required"),
        (("sensors",), {}, "Extra inputs"),
    ],
)
def test_what_is_no_scenario_is_refused(place: tuple[str, ...], value: Any, said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        LogicalScenario.model_validate(content(*place, value=value))


def test_condition_may_be_that_an_event_has_begun() -> None:
    changed = content("storyboard", "change_speed", "when", value="cut_in.begun")
    event = LogicalScenario.model_validate(changed).storyboard["change_speed"]
    assert event.when.names == {"cut_in.begun"}


def test_action_of_an_event_is_the_one_that_it_has() -> None:
    storyboard = LogicalScenario.model_validate(CONTENT).storyboard
    assert isinstance(storyboard["cut_in"].action, LaneChange)
    assert isinstance(storyboard["change_speed"].action, SpeedChange)


@pytest.mark.parametrize(
    ("default", "limits"),
    TABLES["default within its range is a parameter"],
)
def test_default_within_its_range_is_a_parameter(default: Any, limits: Any) -> None:
    parameter = Parameter.model_validate({"default": default, "range": limits})
    assert parameter.default == default


@pytest.mark.parametrize(
    ("default", "limits", "place"),
    [
        ("61 m", ["0 m", "60 m"], ("default",)),
        ("-1 m", ["0 m", "60 m"], ("default",)),
        ("30 m", ["60 m", "0 m"], ("range",)),
        ("30 m", ["0 s", "60 m"], ("range", 0)),
        ("30 m", ["0 m", 60], ("range", 1)),
        ("30 m", ["0 m", "far"], ("range", 1)),
        ("gap", None, ("default",)),
        ("0", None, ("default",)),
        ("1 / 0 m", None, ("default",)),
        ("'text'", None, ("default",)),
        ("30 m", ["0 m"], ("range",)),
        ("30 m", ["0 m", "1 m", "2 m"], ("range",)),
        (True, None, ("default",)),
    ],
)
def test_other_defaults_are_refused_at_their_place(
    default: Any, limits: Any, place: tuple[str | int, ...]
) -> None:
    with pytest.raises(ValidationError) as caught:
        Parameter.model_validate({"default": default, "range": limits})
    assert {item["loc"][: len(place)] for item in caught.value.errors()} == {place}


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("title",), "Another"),
        (("tags",), {}),
        (("provenance", "version"), "2"),
        (("parameters", "gap", "default"), "31 m"),
        (("parameters", "gap", "range"), ["0 m", "90 m"]),
        (("constraints",), []),
    ],
)
def test_words_ranges_and_defaults_are_not_executed(place: tuple[str, ...], value: Any) -> None:
    changed = LogicalScenario.model_validate(content(*place, value=value))
    assert changed.executable() == LogicalScenario.model_validate(CONTENT).executable()


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("world", "road", "shoulder"), "2 m"),
        (("world", "road", "verge"), "2 m"),
        (("world", "road", "bays"), {"bay": BAY}),
        (("environment", "illumination"), "night"),
        (("actors", "cutter", "kind"), "truck"),
        (("storyboard", "cut_in", "when"), "cutter.gap < gap"),
        (("realised",), []),
        (("horizon",), "13 s"),
    ],
)
def test_what_happens_is_executed(place: tuple[str, ...], value: Any) -> None:
    changed = LogicalScenario.model_validate(content(*place, value=value))
    assert changed.executable() != LogicalScenario.model_validate(CONTENT).executable()


def test_a_road_without_bays_and_verge_is_written_as_before_there_were_any() -> None:
    road = LogicalScenario.model_validate(CONTENT).executable()["world"]["road"]  # type: ignore[index]
    assert list(road) == [
        *("kind", "length", "radius", "lanes", "lane_width"),
        *("shoulder", "speed_limit", "markings", "road_type"),
    ]


def test_a_stored_road_with_bays_is_read_as_it_was_written() -> None:
    changed = LogicalScenario.model_validate(content("world", "road", "bays", value={"bay": BAY}))
    road = changed.world.road
    assert type(road).model_validate(road.model_dump(mode="json")) == road
