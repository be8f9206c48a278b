"""Loss of parts: never better, and the critical sensor is the one that is missed."""

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.analysis.suite.analyse import analyse, groups_of
from adeye.analysis.suite.records import Removal, Suite
from tests.analysis.suite.rigs import all_around, architecture, radar


def suite(sensors: dict[str, Any], **options: Any) -> Suite:
    return analyse(architecture(sensors), **options)


def is_not_better(less: Removal, more: Removal) -> bool:
    pairs: list[tuple[float | None, float | None]] = []
    for name in more.seen:
        pairs += [
            (less.seen[name], more.seen[name]),
            (less.front_seen[name], more.front_seen[name]),
            (less.highest_mps[name], more.highest_mps[name]),
            (less.all_cases_mps[name], more.all_cases_mps[name]),
        ]
    return all((low or 0.0) <= (high or 0.0) for low, high in pairs)


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(0.1, 6.0), st.floats(20.0, 200.0), st.floats(-3.1, 3.1)),
        min_size=1,
        max_size=4,
    )
)
def test_less_is_never_better(drawn: list[tuple[float, float, float]]) -> None:
    sensors = {
        f"eye_{number}": radar(
            field_of_view=angle, range=far, mount={"x": 0.0, "y": 0.0, "z": 2.0, "yaw": yaw}
        )
        for number, (angle, far, yaw) in enumerate(drawn)
    }
    found = suite(sensors)
    assert len(found.removals) == len(sensors)
    assert all(is_not_better(item, found.whole) for item in found.removals)


def test_loss_of_a_sensor_for_low_speeds_only_is_no_gain() -> None:
    # Of crossing pedestrians the wide one sees those of a slow ego, the long one of a fast one.
    found = suite({"wide": radar(range=12.0, field_of_view=3.0), "long": radar(field_of_view=0.2)})
    crossing = next(item for item in found.speeds if item.case == "crossing_pedestrian")
    assert crossing.sensor == "long"
    assert crossing.lowest_mps is not None
    assert crossing.lowest_mps > 10.0
    assert all(is_not_better(item, found.whole) for item in found.removals)


def test_critical_sensor_is_the_long_one() -> None:
    found = suite({"long": radar(range=200.0), "short": radar(range=60.0)})
    assert found.critical == "long"
    left = next(item for item in found.removals if item.what == "long")
    assert (
        left.highest_mps["dry_day"]
        == suite({"short": radar(range=60.0)}).whole.highest_mps["dry_day"]
    )


def test_twins_are_not_critical() -> None:
    found = suite({"one": all_around(), "other": all_around()})
    assert found.critical == ""
    for item in found.removals:
        assert item.seen == found.whole.seen
        assert item.highest_mps == found.whole.highest_mps


def test_without_its_only_sensor_nothing_is_left() -> None:
    (gone,) = suite({"only": radar()}).removals
    assert set(gone.seen.values()) == {0.0}
    assert set(gone.highest_mps.values()) == {None}
    assert set(gone.all_cases_mps.values()) == {None}


def test_suite_without_a_sensor_that_looks_around_has_nothing_to_lose() -> None:
    found = suite({"truth": {"kind": "ground_truth", "rate": 20.0}})
    assert found.removals == ()
    assert found.critical == ""
    assert set(found.whole.seen.values()) == {0.0}
    assert set(found.whole.highest_mps.values()) == {None}


def test_element_of_several_sensors_and_shared_resource_fall_as_one() -> None:
    built = architecture(
        {
            "left": radar(realises="radars"),
            "right": radar(realises="radars"),
            "camera": all_around(realises="camera"),
        }
    )
    resources = {"radars": ["power_a"], "camera": ["power_a", "mount_b"]}
    groups = list(groups_of(built, list(built.sensors), resources))
    assert groups == [
        ("camera", "sensor", ("camera",)),
        ("left", "sensor", ("left",)),
        ("right", "sensor", ("right",)),
        ("radars", "element", ("left", "right")),
        ("power_a", "resource", ("camera", "left", "right")),
        ("mount_b", "resource", ("camera",)),
    ]


def test_shared_resource_may_take_all() -> None:
    found = suite(
        {"one": radar(realises="one"), "other": all_around(realises="other")},
        resources={"one": ["power"], "other": ["power"]},
    )
    power = next(item for item in found.removals if item.kind == "resource")
    assert set(power.seen.values()) == {0.0}


def test_share_ahead_is_of_the_lane_ahead() -> None:
    found = suite({"eye": radar(range=90.0 - 0.01, field_of_view=3.0)})
    assert found.whole.front_seen["dry_day"] == pytest.approx(90.0 / 150.0, abs=0.01)
