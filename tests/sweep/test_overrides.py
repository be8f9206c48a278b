"""Overrides by dotted path: one record per variant, and a flaw is the axis's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from adeye.errors import SourceLocation, SweepError
from adeye.sweep.axes import Change, Variants, set_path

if TYPE_CHECKING:
    from collections.abc import Callable

    from adeye.spec.load import OddFiles

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
