"""Axes: values of a quantity, overrides by path, and values for people."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.errors import SourceLocation, SweepError
from adeye.spec.load import OddFiles
from adeye.spec.odd import Sweep
from adeye.spec.scenario import LogicalScenario, Parameter
from adeye.sweep import axes
from adeye.sweep import values as swept
from adeye.sweep.axes import parameter_value as value_of
from adeye.units import Dimension
from tests.refusals import refused
from tests.stored import stored
from tests.sweep.conftest import CAMERA_OUT, Load

TABLES = stored("sweeps")


# --- Axes: exact levels in SI, and what is no axis is refused at its place ------------------------

WHERE = SourceLocation("odd.yaml", 3, 5)
Read = Callable[..., axes.Axis]


@pytest.fixture
def read(load: Callable[..., OddFiles]) -> Read:
    """Return a function that reads one axis of the cut-in."""
    files = load(faults=[CAMERA_OUT])
    reader = axes.AxisReader(files, "cut_in", files.scenarios["cut_in"])

    def make(name: str, spec: Any, *, distinct: bool = True) -> axes.Axis:
        axis = Sweep.model_validate({"parameters": {name: spec}}).parameters[name]
        return reader.read(name, axis, WHERE, distinct=distinct)

    return make


def test_list_is_read_in_si_and_kept_as_written(read: Read) -> None:
    axis = read("ego_speed", ["36 km/h", "20 m/s"])
    assert axis.texts == ("36 km/h", "20 m/s")
    assert axis.values == (10.0, 20.0)
    assert (axis.kind, axis.path, len(axis)) == ("parameter", (), 2)


@pytest.mark.parametrize(("steps", "texts"), TABLES["steps include both ends without rounding"])
def test_steps_include_both_ends_without_rounding(
    read: Read, steps: tuple[str, str, str], texts: tuple[str, ...]
) -> None:
    start, stop, step = steps
    axis = read("gap", {"from": start, "to": stop, "step": step})
    values = tuple(swept.quantity_or_text(text)[0] for text in texts)
    assert axis.values == values


def test_steps_without_a_unit_are_numbers(read: Read) -> None:
    path = "architecture.channels.nominal.parameters.confirm_hits"
    assert read(path, {"from": 2, "to": 4, "step": 1}).texts == (2, 3, 4)
    assert read("friction", {"from": 0.5, "to": 0.7, "step": 0.1}).texts == (0.5, 0.6, 0.7)


@given(start=st.integers(-500, 500), count=st.integers(1, 60), step=st.integers(1, 90))
def test_steps_are_as_many_as_asked_and_evenly_spaced(start: int, count: int, step: int) -> None:
    from adeye.spec.odd import Steps
    from adeye.sweep.axes import _steps

    def tenths(number: int) -> str:
        return f"{number // 10}.{number % 10} m" if number >= 0 else f"-{tenths(-number)}"

    stop = start + (count - 1) * step
    written = {"from": tenths(start), "to": tenths(stop), "step": tenths(step)}
    levels = _steps(Steps.model_validate(written))
    assert [swept.quantity_or_text(level)[0] for level in levels] == [
        swept.quantity_or_text(tenths(start + k * step))[0] for k in range(count)
    ]


def test_what_is_no_axis_is_refused_at_its_place(read: Read) -> None:
    for name, spec, said in TABLES["what is no axis is refused at its place"]:
        caught = refused(SweepError, read, name, spec, says=said)
        assert str(caught).startswith("SweepError: odd.yaml:3:5: ")


def test_zip_may_repeat_a_value(read: Read) -> None:
    assert len(read("gap", ["30 m", "30 m"], distinct=False)) == 2


@pytest.mark.parametrize(("name", "kind", "path"), TABLES["name says what varies"])
def test_name_says_what_varies(read: Read, name: str, kind: str, path: list[str]) -> None:
    values = {"gap": "30 m", "faults.camera_out.onset.at": "1 s"}.get(name, "x")
    axis = read(name, [values])
    assert (axis.kind, axis.path) == (kind, tuple(path))


def test_words_are_kept_as_text(read: Read) -> None:
    policies = ("stuck", "fixed_priority")
    assert read("architecture.switch.policy", list(policies)).values == policies


def test_lists_and_truths_are_kept_as_written_and_named_by_their_text(read: Read) -> None:
    links = read("architecture.channels.nominal.links", [["a"], ["a", "b"], []])
    assert links.texts == (("a",), ("a", "b"), ())
    assert links.values == ("[a]", "[a, b]", "[]")
    assert read("architecture.switch.latch", [True, False]).values == ("true", "false")
    # 1 is no truth: what a file needs decides.
    assert read("architecture.channels.nominal.parameters.confirm_hits", [1, 2]).values == (1, 2)


def test_quantity_or_text() -> None:
    for text, value, dimension in (
        ("90 m", 90.0, Dimension.LENGTH),
        ("-36 km/h", -10.0, Dimension.SPEED),
        (3, 3.0, Dimension.NONE),
        ("left", "left", None),
        ("90 furlongs", "90 furlongs", None),
        ("", "", None),
        ("1 / 0", "1 / 0", None),
    ):
        assert swept.quantity_or_text(text) == (value, dimension)


def test_value_at_the_end_of_its_range_is_inside_whatever_its_unit() -> None:
    parameter = Parameter.model_validate({"default": "1 m/s", "range": ["0 km/h", "130 km/h"]})
    assert value_of(parameter, "130 km/h") == 130 / 3.6
    assert value_of(parameter, "36.11111111111111 m/s") > 36.0
    refused(SweepError, value_of, parameter, "36.2 m/s")


def test_defaults_are_in_si(load: Callable[..., OddFiles]) -> None:
    defaults = axes.default_values(load().scenarios["cut_in"].spec)
    assert defaults["ego_speed"] == 100 / 3.6
    assert defaults["gap"] == 30.0


def test_path_ends_where_the_record_does(load: Callable[..., OddFiles]) -> None:
    spec = load().architectures["camera_radar"].spec
    assert axes.has_path(spec, ())
    assert axes.has_path(spec, ("sensors", "front_radar", "mount", "yaw"))
    assert not axes.has_path(spec, ("sensors", "front_radar", "mount", "yaw", "deg"))
    assert not axes.has_path(spec, ("sensors", "lidar"))


# --- Overrides by dotted path: one record per variant, and a flaw is the axis's -------------------

HERE = SourceLocation("odd.yaml", 5, 9)
THERE = SourceLocation("odd.yaml", 6, 9)


def change(path: str, value: Any, where: SourceLocation = HERE) -> axes.Change:
    return axes.Change(tuple(path.split(".")), value, where)


@pytest.mark.parametrize(("content", "path", "result"), TABLES["value is written at its path"])
def test_value_is_written_at_its_path(content: Any, path: tuple[str, ...], result: Any) -> None:
    before = repr(content)
    assert axes.with_path(content, path, 9) == result
    assert repr(content) == before


def test_file_stays_as_it_was(load: Callable[..., OddFiles]) -> None:
    loaded = load().architectures["camera_radar"]
    assert axes.Variants().of(loaded, ()) is loaded.spec
    before = repr(loaded.content)
    axes.Variants().of(loaded, (change("vehicle.mass", 2000), change("switch.policy", "stuck")))
    assert repr(loaded.content) == before


def test_equal_changes_give_one_record(load: Callable[..., OddFiles]) -> None:
    loaded = load().architectures["camera_radar"]
    variants = axes.Variants()
    far = variants.of(loaded, (change("sensors.front_radar.range", "150 m"),))
    assert variants.of(loaded, (change("sensors.front_radar.range", "150 m", THERE),)) is far
    near = variants.of(loaded, (change("sensors.front_radar.range", "100 m"),))
    assert near is not far
    assert getattr(far.sensors["front_radar"], "range", None) == 150.0
    assert getattr(loaded.spec.sensors["front_radar"], "range", None) == 200.0


def test_variants_share_the_parts_that_are_the_same(load: Load) -> None:
    loaded = load().scenarios["cut_in"]
    made = axes.Variants().of(loaded, (change("world.road.lanes", 4),))
    assert made.world is not loaded.spec.world
    assert made.actors is loaded.spec.actors
    # What the file leaves to its default is not written by the sweep either.
    assert made.model_fields_set == loaded.spec.model_fields_set


def test_what_a_record_makes_of_a_changed_part_is_of_the_change(load: Load) -> None:
    loaded = load().scenarios["cut_in"]
    aside = {
        "actor": "cutter",
        "when": "time >= 1 s",
        "lane_change": {"to_lane": 1, "lateral_speed": "1 m/s"},
    }
    actors = {**loaded.content["actors"], "other": loaded.content["actors"]["cutter"]}
    for before, after in (("cutter", "other"), ("other", "cutter")):
        board = {"swerve": {**aside, "actor": before}, "cut_in": aside}
        content = {**loaded.content, "actors": actors, "storyboard": board}
        spec = LogicalScenario.model_validate(content)
        moved = change("storyboard.swerve.actor", after)
        made = axes.Variants().of(replace(loaded, spec=spec, content=content), (moved,))
        # Of two that move one actor, and begin at one tick, the order is noted.
        noted = ("swerve", "cut_in")
        assert (spec.order, made.order) == ((noted, ()) if after == "other" else ((), noted))


def test_numbers_and_words_keep_their_type(load: Load) -> None:
    changes = change("world.road.lanes", 4), change("environment.illumination", "night")
    made = axes.Variants().of(load().scenarios["cut_in"], changes)
    assert (made.world.road.lanes, made.environment.illumination) == (4, "night")


def test_lists_and_truths_are_written_as_they_stand(load: Callable[..., OddFiles]) -> None:
    loaded = load().architectures["camera_radar"]
    links = ("front_radar", "localisation")
    latch = axes.Change(("switch", "latch"), value=False, where=HERE)
    made = axes.Variants().of(loaded, (change("channels.nominal.links", links), latch))
    assert made.channels["nominal"].links == links
    assert made.switch.latch is False
    with pytest.raises(SweepError, match=r"with switch.latch = 0: switch.latch: .*true or false"):
        axes.Variants().of(loaded, (change("switch.latch", 0),))


def test_flaw_is_placed_at_the_axis_that_wrote_it(load: Callable[..., OddFiles]) -> None:
    loaded = load().architectures["camera_radar"]
    changes = (change("vehicle.mass", 2000), change("sensors.front_radar.range", "5 s", THERE))
    caught = refused(SweepError, axes.Variants().of, loaded, changes)
    assert str(caught) == (
        "SweepError: odd.yaml:6:9: with vehicle.mass = 2000, sensors.front_radar.range = 5 s: "
        "sensors.front_radar.range: '5 s' is not a length. "
        "Write a length like '15 m' (units: m, km, cm, mm)."
    )


def test_flaw_of_the_whole_is_placed_at_the_last_axis(load: Callable[..., OddFiles]) -> None:
    loaded = load().architectures["camera_radar"]
    with pytest.raises(SweepError) as caught:
        axes.Variants().of(
            loaded, (change("vehicle.mass", 1), change("switch.default", "third", THERE))
        )
    assert caught.value.where == THERE
    assert "'third' is not in priority" in str(caught.value)


def test_fault_is_changed_alone(load: Load) -> None:
    files = load(faults=[CAMERA_OUT])
    fault, content = files.odd.spec.faults[0], files.odd.content["faults"][0]
    variants = axes.Variants()
    assert variants.fault(fault, content, ()) is fault
    longer = variants.fault(fault, content, (change("duration", "4 s"),))
    assert (longer.duration, longer.onset.at, fault.duration) == (4.0, 2.0, None)
    assert variants.fault(fault, content, (change("duration", "4 s"),)) is longer
    with pytest.raises(SweepError, match=r"odd.yaml:5:9: with onset.at = -1 s: onset.at: must be"):
        variants.fault(fault, content, (change("onset.at", "-1 s"),))


# --- Swept values for people: in the unit of the scenario's default, and reading back -------------

DEFAULTS = {"ego_speed": "100 km/h", "rain": "0 mm/h", "friction": 0.9}
PARAMETERS = {name: {"default": value} for name, value in DEFAULTS.items()}
RAIN, RANGE = "scenario.environment.rain", "architecture.sensors.front_camera.range"
USE: dict[str, Any] = {"use": "cut_in", "as": None}
SWEPT = {RAIN: {"from": "1 mm/h", "to": "10 mm/h", "step": "3 mm/h"}, "architecture.count": [1, 2]}
ODD: dict[str, Any] = {
    "scenarios": {"cut_in": {"parameters": PARAMETERS}},
    "odd": {
        "scenarios": [
            {**USE, "as": "other", "sweep": {"parameters": {RAIN: ["1 m/s"]}, "points": []}},
            {**USE, "sweep": {"parameters": SWEPT, "points": [{"gap": "3 m"}, {RANGE: "120 m"}]}},
        ]
    },
}


def test_value_is_written_in_the_unit_of_the_default() -> None:
    for value, default, text in (
        (25.0, "100 km/h", "90 km/h"),
        (130 / 3.6, "100 km/h", "130 km/h"),
        (-10 / 3.6, "-30 km/h", "-10 km/h"),
        (1.5, "1 m/s", "1.5 m/s"),
        (7.5e-3 / 3600, "0 mm/h", "7.5 mm/h"),
        (45.0, "30 m", "45 m"),
        (2.2, "1.8 s", "2.2 s"),
        (6.0, "4 m/s^2", "6 m/s²"),
        (0.35, 0.9, "0.35"),
        (3.0, "left", "3"),
    ):
        assert swept.quantity_text(value, default) == text


@pytest.mark.parametrize(
    ("text", "default"),
    [("110 km/h", "100 km/h"), ("2.5 mm/h", "0 mm/h"), ("0.7 m/s", "1 m/s"), ("35 m", "1 km")],
)
def test_what_is_written_reads_back(text: str, default: str) -> None:
    value, _ = swept.quantity_or_text(text)
    again, _ = swept.quantity_or_text(swept.quantity_text(float(value), default))
    assert again == pytest.approx(value, rel=1e-9)


def test_axis_by_path_and_words_are_shown_as_they_are_and_a_point_in_its_order() -> None:
    assert swept.axis_text("architecture.switch.policy", "stuck", ODD, "cut_in") == "stuck"
    assert swept.axis_text("architecture.count", 2.0, ODD, "cut_in") == "2"
    assert swept.axis_text("architecture.vehicle.length", 4.9, ODD, "cut_in") == "4.9"
    assert swept.axis_text("ego_speed", 25.0, ODD, "another") == "25"
    point: dict[str, float | str] = {"rain": 0.0, "ego_speed": 25.0, "friction": 0.5}
    texts = {"rain": "0 mm/h", "ego_speed": "90 km/h", "friction": "0.5"}
    named = [swept.NamedValue(name, text) for name, text in texts.items()]
    assert list(swept.named_values(point, ODD, "cut_in")) == named


def test_axis_by_path_is_written_in_the_unit_of_its_sweep() -> None:
    assert swept.axis_text(RAIN, 4e-3 / 3600, ODD, "cut_in") == "4 mm/h"
    assert swept.axis_text(RAIN, 4e-3 / 3600, ODD, "other") == "1.11111e-06 m/s"
    assert swept.axis_text(RANGE, 120.0, ODD, "cut_in") == "120 m"
