"""Axes: values of a quantity, overrides by path, and values for people."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.errors import SourceLocation, SweepError
from adeye.spec.load import OddFiles
from adeye.spec.odd import Sweep
from adeye.spec.scenario import Parameter
from adeye.sweep.axes import (
    Axis,
    AxisReader,
    Change,
    NamedValue,
    Variants,
    axis_text,
    default_values,
    has_path,
    named_values,
    quantity_or_text,
    quantity_text,
    set_path,
)
from adeye.sweep.axes import parameter_value as value_of
from adeye.units import Dimension

# --- Axes: exact levels in SI, and what is no axis is refused at its place ------------------------

WHERE = SourceLocation("odd.yaml", 3, 5)
Read = Callable[..., Axis]

CAMERA_OUT = {
    "id": "camera_out",
    "target": "sensors.front_camera",
    "model": "drop_out",
    "onset": {"at": "2 s"},
}


@pytest.fixture
def read(load: Callable[..., OddFiles]) -> Read:
    """Return a function that reads one axis of the cut-in."""
    files = load(faults=[CAMERA_OUT])
    reader = AxisReader(files, "cut_in", files.scenarios["cut_in"])

    def make(name: str, spec: Any, *, distinct: bool = True) -> Axis:
        axis = Sweep.model_validate({"parameters": {name: spec}}).parameters[name]
        return reader.read(name, axis, WHERE, distinct=distinct)

    return make


def test_list_is_read_in_si_and_kept_as_written(read: Read) -> None:
    axis = read("ego_speed", ["36 km/h", "20 m/s"])
    assert axis.texts == ("36 km/h", "20 m/s")
    assert axis.values == (10.0, 20.0)
    assert (axis.kind, axis.path, len(axis)) == ("parameter", (), 2)


@pytest.mark.parametrize(
    ("steps", "texts"),
    [
        (("0 m", "60 m", "20 m"), ("0 m", "20 m", "40 m", "60 m")),
        (("0.1 m", "0.5 m", "0.1 m"), ("0.1 m", "0.2 m", "0.3 m", "0.4 m", "0.5 m")),
        (("30 m", "30 m", "1 m"), ("30 m",)),
        (("1e1 m", "2e1 m", "5 m"), ("10 m", "15 m", "20 m")),
    ],
)
def test_steps_include_both_ends_without_rounding(
    read: Read, steps: tuple[str, str, str], texts: tuple[str, ...]
) -> None:
    start, stop, step = steps
    axis = read("gap", {"from": start, "to": stop, "step": step})
    values = tuple(quantity_or_text(text)[0] for text in texts)
    assert axis.values == values


def test_steps_without_a_unit_are_numbers(read: Read) -> None:
    path = "architecture.channels.nominal.parameters.confirm_hits"
    assert read(path, {"from": 2, "to": 4, "step": 1}).texts == (2, 3, 4)
    assert read("friction", {"from": 0.5, "to": 0.7, "step": 0.1}).texts == (0.5, 0.6, 0.7)


@pytest.mark.slow
@given(start=st.integers(-500, 500), count=st.integers(1, 60), step=st.integers(1, 90))
def test_steps_are_as_many_as_asked_and_evenly_spaced(start: int, count: int, step: int) -> None:
    from adeye.spec.odd import Steps
    from adeye.sweep.axes import _steps

    def tenths(number: int) -> str:
        return f"{number // 10}.{number % 10} m" if number >= 0 else f"-{tenths(-number)}"

    stop = start + (count - 1) * step
    written = {"from": tenths(start), "to": tenths(stop), "step": tenths(step)}
    levels = _steps(Steps.model_validate(written))
    assert [quantity_or_text(level)[0] for level in levels] == [
        quantity_or_text(tenths(start + k * step))[0] for k in range(count)
    ]


@pytest.mark.parametrize(
    ("name", "spec", "said"),
    [
        ("gap", [], "has no values"),
        ("gap", ["30 m", "0.03 km"], "a value occurs twice, as '30 m' and '0.03 km'"),
        ("gap", ["30 m", *(f"{n} m" for n in range(20, 31))], "occurs twice, as '30 m'. Remove"),
        ("gap", ["30.00000000001 m", "25 m", "30 m"], "'30 m' and '30.00000000001 m'"),
        ("gap", ["30 s"], "is a time, not a length"),
        ("gap", [30], "is a plain number, not a length"),
        ("gap", ["far"], "is not a quantity like '30 m'"),
        ("gap", [True], "is not a quantity like '30 m'"),
        ("gap", [["30 m", "40 m"]], "is not a quantity like '30 m'"),
        ("architecture.channels.nominal.links", [["a", "b"], ["a", "b"]], "a value occurs twice"),
        ("gap", ["30 kmm"], "is not a quantity like '30 m'"),
        ("gap", ["61 m"], "outside the scenario's range"),
        ("gap", ["-1 m"], "outside the scenario's range"),
        ("gap", {"from": "30 m", "to": "20 m", "step": "5 m"}, "is empty"),
        ("gap", {"from": "20 m", "to": "30 m", "step": "-5 m"}, "is empty"),
        ("gap", {"from": "20 m", "to": "30 m", "step": "0 m"}, "is empty"),
        ("gap", {"from": "20 m", "to": "30 m", "step": "4 m"}, "nearest ends are 28 m and 32 m"),
        ("gap", {"from": "20 m", "to": "30 km", "step": "4 m"}, "different units"),
        ("gap", {"from": "20", "to": "30 m", "step": "4 m"}, "different units"),
        ("gap", {"from": "a", "to": "30 m", "step": "4 m"}, "'a' is not a quantity"),
        ("gap", {"from": "1.2.3 m", "to": "30 m", "step": "4 m"}, "is not a quantity"),
        ("gap", {"from": "0 m", "to": "1e999 m", "step": "1 m"}, "is not a quantity"),
        ("gap", {"from": "0 m", "to": "1 m", "step": "1e-200 m"}, "more than 1,000,000 values"),
        ("gap", {"from": "0 m", "to": "1 m", "step": "0.000001 m"}, "more than 1,000,000 values"),
        ("gaap", ["30 m"], "Did you mean 'gap'"),
        ("scenario", ["30 m"], "neither a parameter"),
        ("architecture.sensors.front_camer.range", ["30 m"], "There are: front_camera"),
        ("scenario.world.road.width", ["30 m"], "There are: kind, length"),
        ("scenario.constraints.0", ["gap > 1 m"], "has no such path"),
        ("faults.camera_ou.duration", ["1 s"], "Did you mean 'camera_out'"),
        ("faults.camera_out.lasts", ["1 s"], "There are: id, target"),
        ("faults.camera_out", ["1 s"], "neither a parameter"),
        ("architecture.architecture", ["a", "b"], "cannot vary"),
        ("architecture.sensors.front_camera.kind", ["radar"], "cannot vary"),
        ("scenario.scenario", ["a"], "cannot vary"),
        ("scenario.parameters.gap.default", ["30 m"], "by its own name"),
        ("faults.camera_out.id", ["a"], "cannot vary"),
        ("faults.camera_out.target", ["channels.nominal"], "cannot vary"),
        ("faults.camera_out.model", ["silent"], "cannot vary"),
    ],
)
def test_what_is_no_axis_is_refused_at_its_place(
    read: Read, name: str, spec: Any, said: str
) -> None:
    with pytest.raises(SweepError) as caught:
        read(name, spec)
    assert said in str(caught.value)
    assert str(caught.value).startswith("SweepError: odd.yaml:3:5: ")


def test_zip_may_repeat_a_value(read: Read) -> None:
    assert len(read("gap", ["30 m", "30 m"], distinct=False)) == 2


@pytest.mark.parametrize(
    ("name", "kind", "path"),
    [
        ("gap", "parameter", ()),
        ("architecture.vehicle.mass", "architecture", ("vehicle", "mass")),
        ("scenario.world.road.kind", "scenario", ("world", "road", "kind")),
        ("faults.camera_out.onset.at", "faults", ("camera_out", "onset", "at")),
    ],
)
def test_name_says_what_varies(read: Read, name: str, kind: str, path: tuple[str, ...]) -> None:
    values = {"gap": "30 m", "faults.camera_out.onset.at": "1 s"}.get(name, "x")
    axis = read(name, [values])
    assert (axis.kind, axis.path) == (kind, path)


def test_words_are_kept_as_text(read: Read) -> None:
    assert read("architecture.switch.policy", ["stuck", "fixed_priority"]).values == (
        "stuck",
        "fixed_priority",
    )


def test_lists_and_truths_are_kept_as_written_and_named_by_their_text(read: Read) -> None:
    links = read("architecture.channels.nominal.links", [["a"], ["a", "b"], []])
    assert links.texts == (("a",), ("a", "b"), ())
    assert links.values == ("[a]", "[a, b]", "[]")
    assert read("architecture.switch.latch", [True, False]).values == ("true", "false")
    # 1 is no truth: what a file needs decides.
    assert read("architecture.channels.nominal.parameters.confirm_hits", [1, 2]).values == (1, 2)


@pytest.mark.parametrize(
    ("text", "value", "dimension"),
    [
        ("90 m", 90.0, Dimension.LENGTH),
        ("-36 km/h", -10.0, Dimension.SPEED),
        (3, 3.0, Dimension.NONE),
        ("left", "left", None),
        ("90 furlongs", "90 furlongs", None),
        ("", "", None),
        ("1 / 0", "1 / 0", None),
    ],
)
def test_quantity_or_text(text: Any, value: Any, dimension: Dimension | None) -> None:
    assert quantity_or_text(text) == (value, dimension)


def test_value_at_the_end_of_its_range_is_inside_whatever_its_unit() -> None:
    parameter = Parameter.model_validate({"default": "1 m/s", "range": ["0 km/h", "130 km/h"]})
    assert value_of(parameter, "130 km/h") == 130 / 3.6
    assert value_of(parameter, "36.11111111111111 m/s") > 36.0
    with pytest.raises(SweepError):
        value_of(parameter, "36.2 m/s")


def test_defaults_are_in_si(load: Callable[..., OddFiles]) -> None:
    defaults = default_values(load().scenarios["cut_in"].spec)
    assert defaults["ego_speed"] == 100 / 3.6
    assert defaults["gap"] == 30.0


def test_path_ends_where_the_record_does(load: Callable[..., OddFiles]) -> None:
    spec = load().architectures["camera_radar"].spec
    assert has_path(spec, ())
    assert has_path(spec, ("sensors", "front_radar", "mount", "yaw"))
    assert not has_path(spec, ("sensors", "front_radar", "mount", "yaw", "deg"))
    assert not has_path(spec, ("sensors", "lidar"))


# --- Overrides by dotted path: one record per variant, and a flaw is the axis's -------------------

HERE = SourceLocation("odd.yaml", 5, 9)
THERE = SourceLocation("odd.yaml", 6, 9)


def change(path: str, value: Any, where: SourceLocation = HERE) -> Change:
    return Change(tuple(path.split(".")), value, where)


@pytest.mark.parametrize(
    ("content", "path", "result"),
    [
        ({"a": 1}, ("a",), {"a": 9}),
        ({"a": {"b": 1, "c": 2}}, ("a", "b"), {"a": {"b": 9, "c": 2}}),
        ({}, ("a", "b", "c"), {"a": {"b": {"c": 9}}}),
        ({"a": None}, ("a", "b"), {"a": {"b": 9}}),
        ({"a": "text"}, ("a", "b"), {"a": {"b": 9}}),
    ],
)
def test_value_is_written_at_its_path(content: Any, path: tuple[str, ...], result: Any) -> None:
    set_path(content, path, 9)
    assert content == result


def test_without_changes_the_file_is_returned(load: Callable[..., OddFiles]) -> None:
    loaded = load().architectures["camera_radar"]
    assert Variants().of(loaded, ()) is loaded.spec


def test_equal_changes_give_one_record(load: Callable[..., OddFiles]) -> None:
    loaded = load().architectures["camera_radar"]
    variants = Variants()
    far = variants.of(loaded, (change("sensors.front_radar.range", "150 m"),))
    assert variants.of(loaded, (change("sensors.front_radar.range", "150 m", THERE),)) is far
    near = variants.of(loaded, (change("sensors.front_radar.range", "100 m"),))
    assert near is not far
    assert getattr(far.sensors["front_radar"], "range", None) == 150.0
    assert getattr(loaded.spec.sensors["front_radar"], "range", None) == 200.0


def test_the_files_content_stays_as_it_was(load: Callable[..., OddFiles]) -> None:
    loaded = load().architectures["camera_radar"]
    before = repr(loaded.content)
    Variants().of(loaded, (change("vehicle.mass", 2000), change("switch.policy", "stuck")))
    assert repr(loaded.content) == before


def test_numbers_and_words_keep_their_type(load: Callable[..., OddFiles]) -> None:
    loaded = load().scenarios["cut_in"]
    made = Variants().of(
        loaded, (change("world.road.lanes", 4), change("environment.illumination", "night"))
    )
    assert made.world.road.lanes == 4
    assert made.environment.illumination == "night"


def test_lists_and_truths_are_written_as_they_stand(load: Callable[..., OddFiles]) -> None:
    loaded = load().architectures["camera_radar"]
    links = ("front_radar", "localisation")
    latch = Change(("switch", "latch"), value=False, where=HERE)
    made = Variants().of(loaded, (change("channels.nominal.links", links), latch))
    assert made.channels["nominal"].links == links
    assert made.switch.latch is False
    with pytest.raises(SweepError, match=r"with switch.latch = 0: switch.latch: .*true or false"):
        Variants().of(loaded, (change("switch.latch", 0),))


def test_flaw_is_placed_at_the_axis_that_wrote_it(load: Callable[..., OddFiles]) -> None:
    loaded = load().architectures["camera_radar"]
    changes = (change("vehicle.mass", 2000), change("sensors.front_radar.range", "5 s", THERE))
    with pytest.raises(SweepError) as caught:
        Variants().of(loaded, changes)
    assert str(caught.value) == (
        "SweepError: odd.yaml:6:9: with vehicle.mass = 2000, sensors.front_radar.range = 5 s: "
        "sensors.front_radar.range: '5 s' is not a length. "
        "Write a length like '15 m' (units: m, km, cm, mm)."
    )


def test_flaw_of_the_whole_is_placed_at_the_last_axis(load: Callable[..., OddFiles]) -> None:
    loaded = load().architectures["camera_radar"]
    with pytest.raises(SweepError) as caught:
        Variants().of(loaded, (change("vehicle.mass", 1), change("switch.default", "third", THERE)))
    assert caught.value.where == THERE
    assert "'third' is not in priority" in str(caught.value)


def test_fault_is_changed_alone(load: Callable[..., OddFiles]) -> None:
    out = {
        "id": "out",
        "target": "sensors.front_camera",
        "model": "drop_out",
        "onset": {"at": "1 s"},
    }
    files = load(faults=[out])
    fault, content = files.odd.spec.faults[0], files.odd.content["faults"][0]
    variants = Variants()
    assert variants.fault(fault, content, ()) is fault
    longer = variants.fault(fault, content, (change("duration", "4 s"),))
    assert (longer.duration, longer.onset.at, fault.duration) == (4.0, 1.0, None)
    assert variants.fault(fault, content, (change("duration", "4 s"),)) is longer
    with pytest.raises(SweepError, match=r"odd.yaml:5:9: with onset.at = -1 s: onset.at: must be"):
        variants.fault(fault, content, (change("onset.at", "-1 s"),))


# --- Swept values for people: in the unit of the scenario's default, and reading back -------------

ODD: dict[str, Any] = {
    "scenarios": {
        "cut_in": {
            "parameters": {
                "ego_speed": {"default": "100 km/h"},
                "lateral_speed": {"default": "1.5 m/s"},
                "rain": {"default": "0 mm/h"},
                "friction": {"default": 0.9},
            }
        }
    }
}


@pytest.mark.parametrize(
    ("value", "default", "text"),
    [
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
    ],
)
def test_value_is_written_in_the_unit_of_the_default(value: float, default: Any, text: str) -> None:
    assert quantity_text(value, default) == text


@pytest.mark.parametrize(
    ("text", "default"),
    [("110 km/h", "100 km/h"), ("2.5 mm/h", "0 mm/h"), ("0.7 m/s", "1 m/s"), ("35 m", "1 km")],
)
def test_what_is_written_reads_back(text: str, default: str) -> None:
    value, _ = quantity_or_text(text)
    again, _ = quantity_or_text(quantity_text(float(value), default))
    assert again == pytest.approx(value, rel=1e-9)


def test_axis_by_path_and_words_are_shown_as_they_are() -> None:
    assert axis_text("architecture.switch.policy", "stuck", ODD, "cut_in") == "stuck"
    assert axis_text("architecture.sensors.front_camera.range", 120.0, ODD, "cut_in") == "120"
    assert axis_text("ego_speed", 25.0, ODD, "another") == "25"


def test_point_is_named_in_its_order() -> None:
    point: dict[str, float | str] = {"rain": 0.0, "ego_speed": 25.0, "friction": 0.5}
    assert named_values(point, ODD, "cut_in") == (
        NamedValue("rain", "0 mm/h"),
        NamedValue("ego_speed", "90 km/h"),
        NamedValue("friction", "0.5"),
    )
