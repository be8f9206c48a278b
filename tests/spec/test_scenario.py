"""Logical scenarios: what belongs together is asked for, and identity is what is executed."""

import copy
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.document import load_document
from adeye.spec.load import load_scenario
from adeye.spec.quantity import SI
from adeye.spec.scenario import LaneChange, LogicalScenario, Parameter, PlaceQuery, SpeedChange
from adeye.sweep.axes import with_path
from tests.refusals import refused
from tests.stored import stored

TABLES = stored("definitions")


ROOT = Path(__file__).parents[2] / "scenarios_db"
SHIPPED = sorted(ROOT.rglob("*.yaml"))
BAY = {"kind": "parking_bay", "s": "400 m", "length": "60 m", "depth": "4 m", "taper": "20 m"}

CONTENT: dict[str, Any] = load_document(ROOT / "motorway" / "cut_in.yaml").value


def content(*place: str, value: Any) -> dict[str, Any]:
    """Return the shipped cut-in with one value changed; None removes it."""
    changed = with_path(copy.deepcopy(CONTENT), place, value)
    if value is None:
        part: Any = changed
        for key in place[:-1]:
            part = part[key]
        del part[place[-1]]
    return changed


@pytest.mark.parametrize("path", SHIPPED, ids=[path.stem for path in SHIPPED])
def test_shipped_scenario_reads_back_from_its_stored_form(path: Path) -> None:
    spec = load_scenario(path).spec
    assert spec.scenario == path.stem
    assert LogicalScenario.model_validate(spec.model_dump(mode="json"), context=SI) == spec


@pytest.mark.parametrize(("place", "value", "said"), TABLES["what is no scenario is refused"])
def test_what_is_no_scenario_is_refused(place: tuple[str, ...], value: Any, said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        LogicalScenario.model_validate(content(*place, value=value))


@pytest.mark.parametrize(("key", "value"), [("grades", [[0.0, 0.3]]), ("heading", 1.0)])
def test_a_road_of_ones_own_takes_nothing_of_a_map(key: str, value: Any) -> None:
    with pytest.raises(ValidationError, match="a place of a map says where a road is"):
        LogicalScenario.model_validate(content("world", "road", key, value=value))


def test_condition_may_be_that_an_event_has_begun() -> None:
    changed = content("storyboard", "change_speed", "when", value="cut_in.begun")
    event = LogicalScenario.model_validate(changed).storyboard["change_speed"]
    assert event.when.names == {"cut_in.begun"}


def test_action_of_an_event_is_the_one_that_it_has() -> None:
    storyboard = LogicalScenario.model_validate(CONTENT).storyboard
    assert isinstance(storyboard["cut_in"].action, LaneChange)
    assert isinstance(storyboard["change_speed"].action, SpeedChange)


@pytest.mark.parametrize(("default", "limits"), TABLES["default within its range is a parameter"])
def test_default_within_its_range_is_a_parameter(default: Any, limits: Any) -> None:
    parameter = Parameter.model_validate({"default": default, "range": limits})
    assert parameter.default == default


def test_other_defaults_are_refused_at_their_place() -> None:
    for default, limits, place in TABLES["other defaults are refused at their place"]:
        caught = refused(
            ValidationError, Parameter.model_validate, {"default": default, "range": limits}
        )
        assert {item["loc"][: len(place)] for item in caught.errors()} == {tuple(place)}


@pytest.mark.parametrize(("place", "value"), TABLES["words ranges and defaults are not executed"])
def test_words_ranges_and_defaults_are_not_executed(place: tuple[str, ...], value: Any) -> None:
    changed = LogicalScenario.model_validate(content(*place, value=value))
    assert changed.executable() == LogicalScenario.model_validate(CONTENT).executable()


def test_own_tags_have_names_and_text_and_none_is_nearly_that_of_a_catalogue() -> None:
    made = LogicalScenario.model_validate(content("tags", "team", value="planning"))
    assert made.tags.own == {"team": "planning"}
    assert made.tags.by_name["r157"] == "4.4.1"
    assert LogicalScenario.model_validate(made.model_dump(mode="json"), context=SI) == made
    for name, value, said in (
        ("nthsa", "a", "nearly 'nhtsa'"),
        ("Team", "a", "is no name"),
        ("team", 3, "valid string"),
        ("team", "", "at least 1"),
    ):
        with pytest.raises(ValidationError, match=said):
            LogicalScenario.model_validate(content("tags", name, value=value))


def test_weather_that_is_not_said_is_dry_and_clear() -> None:
    said = {"rain": "0 mm/h", "fog_visibility": "10 km", "friction": 0.9}
    whole, short = (
        content("environment", value=said),
        content("environment", value={"friction": 0.9}),
    )
    dry, unsaid = (LogicalScenario.model_validate(item) for item in (whole, short))
    assert unsaid.executable() == dry.executable()
    with pytest.raises(ValidationError, match=r"environment.friction"):
        LogicalScenario.model_validate(content("environment", value={}))


def test_what_happens_is_executed() -> None:
    for place, value in (
        (("world", "road", "shoulder"), "2 m"),
        (("world", "road", "verge"), "2 m"),
        (("world", "road", "bays"), {"bay": BAY}),
        (("environment", "illumination"), "night"),
        (("actors", "cutter", "kind"), "truck"),
        (("storyboard", "cut_in", "when"), "cutter.gap < gap"),
        (("realised",), []),
        (("horizon",), "13 s"),
    ):
        changed = LogicalScenario.model_validate(content(*place, value=value))
        assert changed.executable() != LogicalScenario.model_validate(CONTENT).executable(), place


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


def test_a_route_over_a_ramp_begins_at_the_place_of_its_kind() -> None:
    assert PlaceQuery(anchor="exit", after="100 m", route="exit").route == "exit"
    with pytest.raises(ValidationError, match="takes anchor: exit"):
        PlaceQuery(anchor="entry", after="100 m", route="exit")
