"""Which objects matter, and what sensors and channel make of them, over hand-made runs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS
from adeye.kernel.encounter import reachable_distance
from adeye.trace import NO_TRACKS

REACH = reachable_distance(20.0, 1.0)
"""Of the ego, which drives 2 m from row to row [m]."""
MATTERS_FROM = 22
"""First row of ``approach`` at which the wall is no farther than that."""


def measure(made: Any, column: str) -> Any:
    found = METRICS[column].compute(made.trace())
    return float(found.value[0]), found.status[0], float(found.time[0]), int(found.actor[0])


def approach(hand_made: Any, *objects: str) -> Any:
    """A standing wall, 96 m ahead from body to body; the ego drives 2 m from row to row."""
    made = hand_made(objects=objects or ("wall",), rows=41)
    return made.object("wall", s=100.0, speed=0.0)


def test_scene_of_these_tests_is_as_they_say() -> None:
    assert 96.0 - 2.0 * (MATTERS_FROM - 1) > REACH >= 96.0 - 2.0 * MATTERS_FROM


# --- latency --------------------------------------------------------------------------------------


def test_latency_counts_from_when_the_object_matters_to_its_detection(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["detected"][0, MATTERS_FROM + 4 :, 0, 0] = True
    expected = (pytest.approx(0.4), "value", pytest.approx(0.1 * (MATTERS_FROM + 4)), 0)
    assert measure(made, "detection_latency_s") == expected


def test_latency_is_zero_for_what_is_seen_before_it_matters(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["detected"][0, 3:, 0, 0] = True
    assert measure(made, "detection_latency_s")[:2] == (0.0, "value")


def test_object_that_is_never_detected_is_late_to_the_end(hand_made: Any) -> None:
    value, status, _, actor = measure(approach(hand_made), "detection_latency_s")
    assert (value, status, actor) == (pytest.approx(0.1 * (40 - MATTERS_FROM)), "value", 0)


def test_ground_truth_detects_nothing_for_the_latency(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["detected"][0, :, 1, 0] = True
    assert measure(made, "detection_latency_s")[0] > 1.0


def test_far_object_does_not_matter(hand_made: Any) -> None:
    made = approach(hand_made).object("wall", s=4.0 + 80.0 + REACH + 0.1)
    assert measure(made, "detection_latency_s")[1] == "not_applicable"
    assert measure(made, "missed_time_s")[1] == "not_applicable"


def test_far_object_matters_on_a_slippery_road(hand_made: Any) -> None:
    trace = approach(hand_made).object("wall", s=4.0 + 80.0 + REACH + 0.1).trace()
    trace.layout.context.surroundings.friction[:] = 0.5
    assert METRICS["detection_latency_s"].compute(trace).status == ("value",)


def test_hidden_object_matters_when_half_of_it_comes_out(hand_made: Any) -> None:
    # A screen 9 m ahead, beside the path; a pedestrian at 18 m walks out from behind it.
    made = approach(hand_made, "screen", "wall")
    made.object("wall", size=(0.5, 0.5), heading=math.pi / 2.0, speed=1.5, s=18.0)
    made.object("wall", d=1.0 + 0.15 * np.arange(41))
    made.ego(speed=10.0, s=np.zeros(41))
    made.object("screen", size=(0.2, 3.0), s=9.0, speed=0.0, d=2.2)
    made.columns["detected"][0, 35:, 0, 1] = True
    hidden = measure(made, "detection_latency_s")[0]
    made.object("screen", d=30.0)
    in_the_open = measure(made, "detection_latency_s")[0]
    # The shadow ends on the line from the ego's centre past the screen's far corner (9.1, 3.7).
    comes_out = (5.25 - 18.0 / 9.1 * (5.25 - 3.7) - 1.0) / 1.5
    assert hidden == pytest.approx(3.5 - math.ceil(comes_out * 10.0) / 10.0)
    assert in_the_open == pytest.approx(3.5)


def test_object_beside_the_path_does_not_matter(hand_made: Any) -> None:
    made = approach(hand_made).object("wall", d=8.75)
    assert measure(made, "detection_latency_s")[1] == "not_applicable"


def test_latest_of_several_objects_counts(hand_made: Any) -> None:
    # The lead leaves the path at row 30 and shows the wall behind it.
    made = approach(hand_made, "lead", "wall")
    made.object("lead", d=np.where(np.arange(41) < 30, 5.25, 8.75), s=30.0 + 2.0 * np.arange(41))
    made.object("wall", s=115.0)
    made.columns["detected"][0, 1:, 0, 0] = True
    made.columns["detected"][0, 33:, 0, 1] = True
    assert measure(made, "detection_latency_s") == (
        pytest.approx(0.3),
        "value",
        pytest.approx(3.3),
        1,
    )


def test_unknown_place_is_an_error(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["objects"][0, 3, 0, 0] = np.nan
    for column in (
        "detection_latency_s",
        "missed_time_s",
        "range_error_rms_m",
        "rear_detection_margin_m",
    ):
        assert measure(made, column)[1] == "error", column


# --- missed and false tracks ----------------------------------------------------------------------


def test_missed_time_counts_the_rows_without_a_track(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["track_error"][0, MATTERS_FROM + 5 :, 0, 0] = 0.1
    made.columns["track_error"][0, MATTERS_FROM + 8, 0, 0] = np.nan
    expected = (pytest.approx(0.6), "value", pytest.approx(0.1 * MATTERS_FROM), 0)
    assert measure(made, "missed_time_s") == expected


def test_what_is_tracked_all_the_time_is_missed_for_no_time(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["track_error"][0, :, 0, 0] = 0.1
    assert measure(made, "missed_time_s")[:2] == (0.0, "value")


def test_what_is_not_tracked_before_it_matters_is_not_missed(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["track_error"][0, MATTERS_FROM:, 0, 0] = 0.1
    assert measure(made, "missed_time_s")[:2] == (0.0, "value")


def test_track_of_another_channel_helps_nobody(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["track_error"][0, :, 1, 0] = 0.1
    assert measure(made, "missed_time_s")[0] == pytest.approx(0.1 * (40 - MATTERS_FROM))


def test_channel_that_shows_no_tracks_is_not_judged(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["false_tracks"][:, :, 0] = NO_TRACKS
    assert measure(made, "missed_time_s")[1] == "not_applicable"
    assert measure(made, "false_track_time_s")[1] == "not_applicable"


def test_channel_that_stops_to_show_tracks_misses_what_matters(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["false_tracks"][:, 1:, 0] = NO_TRACKS
    assert measure(made, "missed_time_s")[1] == "value"


def test_false_track_time_counts_rows_not_tracks(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["false_tracks"][0, 7:10, 0] = 2
    made.columns["false_tracks"][0, :, 1] = 1
    assert measure(made, "false_track_time_s") == (
        pytest.approx(0.3),
        "value",
        pytest.approx(0.7),
        -1,
    )


def test_channel_that_imagines_nothing_has_no_false_time(hand_made: Any) -> None:
    assert measure(approach(hand_made), "false_track_time_s")[:2] == (0.0, "value")


# --- errors ---------------------------------------------------------------------------------------


def test_range_error_is_the_root_of_the_mean_square(hand_made: Any) -> None:
    made = approach(hand_made)
    # Before it is within reach the error is huge and does not count.
    made.columns["track_error"][0, :MATTERS_FROM, 0, 0] = 50.0
    made.columns["track_error"][0, 30, 0, 0] = (-3.0, 9.0)
    made.columns["track_error"][0, 31, 0, 0] = (4.0, 9.0)
    expected = (pytest.approx(math.sqrt(12.5)), "value", pytest.approx(3.1), 0)
    assert measure(made, "range_error_rms_m") == expected


def test_position_error_is_what_nineteen_of_twenty_rows_keep(hand_made: Any) -> None:
    made = approach(hand_made).object("wall", s=4.0 + 96.0 - 40.0)
    sizes = np.arange(1.0, 21.0)
    made.columns["track_error"][0, 2:22, 0, 0, 0] = 0.6 * sizes[::-1]
    made.columns["track_error"][0, 2:22, 0, 0, 1] = 0.8 * sizes[::-1]
    expected = (pytest.approx(19.0), "value", pytest.approx(0.2), 0)
    assert measure(made, "position_error_p95_m") == expected


def test_without_a_track_there_is_no_error_to_tell(hand_made: Any) -> None:
    assert measure(approach(hand_made), "range_error_rms_m")[1] == "not_applicable"
    assert measure(approach(hand_made), "position_error_p95_m")[1] == "not_applicable"
