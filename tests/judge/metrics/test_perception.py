"""First detection over hand-made runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS
from adeye.judge.metrics.perception import measuring_sensors

if TYPE_CHECKING:
    from adeye.spec.architecture import Architecture

COLUMN = "first_detection_distance_m"


def measure(made: Any) -> Any:
    found = METRICS[COLUMN].compute(made.trace())
    return float(found.value[0]), found.status[0], float(found.time[0]), found.actor[0]


def approach(hand_made: Any, *objects: str) -> Any:
    """A standing object, 96 m ahead from body to body; the ego drives 2 m from row to row."""
    made = hand_made(objects=objects or ("wall",))
    return made.object("wall", s=100.0, speed=0.0)


def test_distance_is_that_of_the_first_row_with_a_detection(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["detected"][0, 4:, 0, 0] = True
    assert measure(made) == (pytest.approx(88.0), "value", pytest.approx(0.4), 0)


def test_object_that_is_never_detected_is_found_at_zero(hand_made: Any) -> None:
    assert measure(approach(hand_made)) == (0.0, "value", 2.0, 0)


def test_ground_truth_does_not_detect(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["detected"][0, :, 1, 0] = True
    assert measure(made)[0] == 0.0


def test_object_beside_the_path_does_not_matter(hand_made: Any) -> None:
    made = approach(hand_made).object("wall", d=8.75)
    made.columns["detected"][0, 4:, 0, 0] = True
    assert measure(made)[1] == "not_applicable"


def test_object_that_is_found_last_counts(hand_made: Any) -> None:
    # The lead leaves the path and shows the wall behind it.
    made = approach(hand_made, "lead", "wall")
    made.object("lead", d=np.where(np.arange(21) < 10, 5.25, 8.75))
    made.columns["detected"][0, 0:, 0, 0] = True
    made.columns["detected"][0, 12:, 0, 1] = True
    assert measure(made) == (pytest.approx(72.0), "value", pytest.approx(1.2), 1)


def test_nearer_of_two_found_together_counts(hand_made: Any) -> None:
    made = approach(hand_made, "lead", "wall")
    made.object("lead", d=np.where(np.arange(21) < 10, 5.25, 8.75))
    made.columns["detected"][0, 3:, 0, :] = True
    assert measure(made) == (pytest.approx(40.0), "value", pytest.approx(0.3), 0)


def test_unknown_place_is_an_error(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["objects"][0, 3, 0, 0] = np.nan
    assert measure(made)[1] == "error"


def test_sensor_without_a_link_does_not_count(hand_made: Any, architecture: Any) -> None:
    layout = hand_made().trace().layout
    assert measuring_sensors(layout) == (0,)
    channels = {"safety": {"kind": "safety", "links": ["truth"], "rate": "10 Hz"}}
    switch = {"policy": "stuck", "priority": ["safety"], "default": "safety"}
    blind: Architecture = architecture(channels=channels, switch=switch)
    object.__setattr__(layout, "architecture", blind)
    assert measuring_sensors(layout) == ()


def test_architecture_without_a_measuring_sensor_is_not_applicable(
    hand_made: Any, architecture: Any
) -> None:
    trace = approach(hand_made).trace()
    channels = {"safety": {"kind": "safety", "links": ["truth"], "rate": "10 Hz"}}
    switch = {"policy": "stuck", "priority": ["safety"], "default": "safety"}
    object.__setattr__(trace.layout, "architecture", architecture(channels=channels, switch=switch))
    assert METRICS[COLUMN].compute(trace).status == ("not_applicable",)
