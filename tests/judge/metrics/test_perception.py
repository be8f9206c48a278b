"""First detection, what matters, and who comes from behind, over hand-made runs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS
from adeye.judge.metrics.perception import measuring_sensors
from adeye.kernel.encounter import reachable_distance
from adeye.trace import NO_TRACKS
from tests.judge.conftest import measure

if TYPE_CHECKING:
    from adeye.spec.architecture import Architecture

COLUMN = "first_detection_distance_m"


def first_detection(made: Any) -> Any:
    return measure(made, COLUMN)


def approach(hand_made: Any, *objects: str) -> Any:
    """A standing object, 96 m ahead from body to body; the ego drives 2 m from row to row."""
    made = hand_made(objects=objects or ("wall",))
    return made.object("wall", s=100.0, speed=0.0)


def test_distance_is_that_of_the_first_row_with_a_detection(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["detected"][0, 4:, 0, 0] = True
    assert first_detection(made) == (pytest.approx(88.0), "value", pytest.approx(0.4), 0)


def test_object_that_is_never_detected_is_found_at_zero(hand_made: Any) -> None:
    assert first_detection(approach(hand_made)) == (0.0, "value", 2.0, 0)


def test_ground_truth_does_not_detect(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["detected"][0, :, 1, 0] = True
    assert first_detection(made)[0] == 0.0


def test_object_beside_the_path_does_not_matter(hand_made: Any) -> None:
    made = approach(hand_made).object("wall", d=8.75)
    made.columns["detected"][0, 4:, 0, 0] = True
    assert first_detection(made)[1] == "not_applicable"


def test_object_that_is_found_last_counts(hand_made: Any) -> None:
    # The lead leaves the path and shows the wall behind it.
    made = approach(hand_made, "lead", "wall")
    made.object("lead", d=np.where(np.arange(21) < 10, 5.25, 8.75))
    made.columns["detected"][0, 0:, 0, 0] = True
    made.columns["detected"][0, 12:, 0, 1] = True
    assert first_detection(made) == (pytest.approx(72.0), "value", pytest.approx(1.2), 1)


def test_nearer_of_two_found_together_counts(hand_made: Any) -> None:
    made = approach(hand_made, "lead", "wall")
    made.object("lead", d=np.where(np.arange(21) < 10, 5.25, 8.75))
    made.columns["detected"][0, 3:, 0, :] = True
    assert first_detection(made) == (pytest.approx(40.0), "value", pytest.approx(0.3), 0)


def test_unknown_place_is_an_error(hand_made: Any) -> None:
    made = approach(hand_made)
    made.columns["objects"][0, 3, 0, 0] = np.nan
    assert first_detection(made)[1] == "error"


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


REACH = reachable_distance(20.0, 1.0)
"""Of the ego, which drives 2 m from row to row [m]."""
MATTERS_FROM = 22
"""First row of ``approach`` at which the wall is no farther than that."""


def nearing(hand_made: Any, *objects: str) -> Any:
    """A standing wall, 96 m ahead from body to body; the ego drives 2 m from row to row."""
    made = hand_made(objects=objects or ("wall",), rows=41)
    return made.object("wall", s=100.0, speed=0.0)


def test_scene_of_these_tests_is_as_they_say() -> None:
    assert 96.0 - 2.0 * (MATTERS_FROM - 1) > REACH >= 96.0 - 2.0 * MATTERS_FROM


# --- latency --------------------------------------------------------------------------------------


def test_latency_counts_from_when_the_object_matters_to_its_detection(hand_made: Any) -> None:
    made = nearing(hand_made)
    made.columns["detected"][0, MATTERS_FROM + 4 :, 0, 0] = True
    expected = (pytest.approx(0.4), "value", pytest.approx(0.1 * (MATTERS_FROM + 4)), 0)
    assert measure(made, "detection_latency_s") == expected


def test_latency_is_zero_for_what_is_seen_before_it_matters(hand_made: Any) -> None:
    made = nearing(hand_made)
    made.columns["detected"][0, 3:, 0, 0] = True
    assert measure(made, "detection_latency_s")[:2] == (0.0, "value")


def test_object_that_is_never_detected_is_late_to_the_end(hand_made: Any) -> None:
    value, status, _, actor = measure(nearing(hand_made), "detection_latency_s")
    assert (value, status, actor) == (pytest.approx(0.1 * (40 - MATTERS_FROM)), "value", 0)


def test_ground_truth_detects_nothing_for_the_latency(hand_made: Any) -> None:
    made = nearing(hand_made)
    made.columns["detected"][0, :, 1, 0] = True
    assert measure(made, "detection_latency_s")[0] > 1.0


def test_far_object_does_not_matter(hand_made: Any) -> None:
    made = nearing(hand_made).object("wall", s=4.0 + 80.0 + REACH + 0.1)
    assert measure(made, "detection_latency_s")[1] == "not_applicable"
    assert measure(made, "missed_time_s")[1] == "not_applicable"


def test_far_object_matters_on_a_slippery_road(hand_made: Any) -> None:
    trace = nearing(hand_made).object("wall", s=4.0 + 80.0 + REACH + 0.1).trace()
    trace.layout.context.surroundings.friction[:] = 0.5
    assert METRICS["detection_latency_s"].compute(trace).status == ("value",)


def test_hidden_object_matters_when_half_of_it_comes_out(hand_made: Any) -> None:
    # A screen 9 m ahead, beside the path; a pedestrian at 18 m walks out from behind it.
    made = nearing(hand_made, "screen", "wall")
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


def test_object_beside_the_path_is_never_late(hand_made: Any) -> None:
    made = nearing(hand_made).object("wall", d=8.75)
    assert measure(made, "detection_latency_s")[1] == "not_applicable"


def test_latest_of_several_objects_counts(hand_made: Any) -> None:
    # The lead leaves the path at row 30 and shows the wall behind it.
    made = nearing(hand_made, "lead", "wall")
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


def test_unknown_place_is_an_error_of_all(hand_made: Any) -> None:
    made = nearing(hand_made)
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
    made = nearing(hand_made)
    made.columns["track_error"][0, MATTERS_FROM + 5 :, 0, 0] = 0.1
    made.columns["track_error"][0, MATTERS_FROM + 8, 0, 0] = np.nan
    expected = (pytest.approx(0.6), "value", pytest.approx(0.1 * MATTERS_FROM), 0)
    assert measure(made, "missed_time_s") == expected


def test_what_is_tracked_all_the_time_is_missed_for_no_time(hand_made: Any) -> None:
    made = nearing(hand_made)
    made.columns["track_error"][0, :, 0, 0] = 0.1
    assert measure(made, "missed_time_s")[:2] == (0.0, "value")


def test_what_is_not_tracked_before_it_matters_is_not_missed(hand_made: Any) -> None:
    made = nearing(hand_made)
    made.columns["track_error"][0, MATTERS_FROM:, 0, 0] = 0.1
    assert measure(made, "missed_time_s")[:2] == (0.0, "value")


def test_track_of_another_channel_helps_nobody(hand_made: Any) -> None:
    made = nearing(hand_made)
    made.columns["track_error"][0, :, 1, 0] = 0.1
    assert measure(made, "missed_time_s")[0] == pytest.approx(0.1 * (40 - MATTERS_FROM))


def test_channel_that_shows_no_tracks_is_not_judged(hand_made: Any) -> None:
    made = nearing(hand_made)
    made.columns["false_tracks"][:, :, 0] = NO_TRACKS
    assert measure(made, "missed_time_s")[1] == "not_applicable"
    assert measure(made, "false_track_time_s")[1] == "not_applicable"


def test_channel_that_stops_to_show_tracks_misses_what_matters(hand_made: Any) -> None:
    made = nearing(hand_made)
    made.columns["false_tracks"][:, 1:, 0] = NO_TRACKS
    assert measure(made, "missed_time_s")[1] == "value"


def test_false_track_time_counts_rows_not_tracks(hand_made: Any) -> None:
    made = nearing(hand_made)
    made.columns["false_tracks"][0, 7:10, 0] = 2
    made.columns["false_tracks"][0, :, 1] = 1
    assert measure(made, "false_track_time_s") == (
        pytest.approx(0.3),
        "value",
        pytest.approx(0.7),
        -1,
    )


def test_channel_that_imagines_nothing_has_no_false_time(hand_made: Any) -> None:
    assert measure(nearing(hand_made), "false_track_time_s")[:2] == (
        0.0,
        "value",
    )


# --- errors ---------------------------------------------------------------------------------------


def test_range_error_is_the_root_of_the_mean_square(hand_made: Any) -> None:
    made = nearing(hand_made)
    # Before it is within reach the error is huge and does not count.
    made.columns["track_error"][0, :MATTERS_FROM, 0, 0] = 50.0
    made.columns["track_error"][0, 30, 0, 0] = (-3.0, 9.0)
    made.columns["track_error"][0, 31, 0, 0] = (4.0, 9.0)
    expected = (pytest.approx(math.sqrt(12.5)), "value", pytest.approx(3.1), 0)
    assert measure(made, "range_error_rms_m") == expected


def test_position_error_is_what_nineteen_of_twenty_rows_keep(hand_made: Any) -> None:
    made = nearing(hand_made).object("wall", s=4.0 + 96.0 - 40.0)
    sizes = np.arange(1.0, 21.0)
    made.columns["track_error"][0, 2:22, 0, 0, 0] = 0.6 * sizes[::-1]
    made.columns["track_error"][0, 2:22, 0, 0, 1] = 0.8 * sizes[::-1]
    expected = (pytest.approx(19.0), "value", pytest.approx(0.2), 0)
    assert measure(made, "position_error_p95_m") == expected


def test_without_a_track_there_is_no_error_to_tell(hand_made: Any) -> None:
    assert measure(nearing(hand_made), "range_error_rms_m")[1] == "not_applicable"
    assert measure(nearing(hand_made), "position_error_p95_m")[1] == "not_applicable"


CRITICAL = 10.0 * 0.4 + 10.0**2 / 6.0 + 20.0
"""What somebody 10 m/s faster than the ego's 20 m/s needs [m]."""


def margin_behind(made: Any) -> Any:
    return measure(made, "rear_detection_margin_m")


def overtaken(hand_made: Any, *objects: str, behind: float = 80.0) -> Any:
    """Somebody 10 m/s faster in the left lane, who gains 1 m from row to row."""
    made = hand_made(objects=objects or ("fast",), rows=101)
    return made.object("fast", s=3.0 * np.arange(101) - behind - 4.0, speed=30.0, d=8.75)


def test_margin_is_the_distance_of_the_first_detection_less_the_critical(hand_made: Any) -> None:
    made = overtaken(hand_made)
    made.columns["detected"][0, 20:, 0, 0] = True
    assert margin_behind(made) == (pytest.approx(60.0 - CRITICAL), "value", 2.0, 0)


def test_who_is_never_seen_is_at_zero(hand_made: Any) -> None:
    assert margin_behind(overtaken(hand_made))[:2] == (pytest.approx(-CRITICAL), "value")


def test_who_is_seen_alongside_only_is_at_zero(hand_made: Any) -> None:
    made = overtaken(hand_made)
    made.columns["detected"][0, 81:, 0, 0] = True
    assert margin_behind(made)[0] == pytest.approx(-CRITICAL)


def test_ground_truth_does_not_see(hand_made: Any) -> None:
    made = overtaken(hand_made)
    made.columns["detected"][0, :, 1, 0] = True
    assert margin_behind(made)[0] == pytest.approx(-CRITICAL)


def test_who_is_too_near_from_the_start_does_not_count(hand_made: Any) -> None:
    assert margin_behind(overtaken(hand_made, behind=CRITICAL - 0.5))[1] == "not_applicable"
    assert margin_behind(overtaken(hand_made, behind=CRITICAL + 0.5))[1] == "value"


@pytest.mark.parametrize(
    ("why", "change"),
    [
        ("slower", {"speed": 19.0}),
        ("in the lane of the ego", {"d": 5.25}),
        ("two lanes away", {"d": 5.25 + 1.5 * 3.5 + 0.1}),
        ("ahead", {"s": 50.0 + 3.0 * np.arange(101)}),
    ],
)
def test_who_does_not_come_from_behind_in_the_next_lane_does_not_count(
    hand_made: Any, why: str, change: dict[str, Any]
) -> None:
    assert margin_behind(overtaken(hand_made).object("fast", **change))[1] == "not_applicable", why


def test_worst_of_two_counts(hand_made: Any) -> None:
    made = overtaken(hand_made, "fast", "faster")
    made.object("faster", s=4.0 * np.arange(101) - 154.0, speed=40.0, d=1.75)
    made.columns["detected"][0, 20:, 0, :] = True
    critical = 20.0 * 0.4 + 20.0**2 / 6.0 + 20.0
    assert margin_behind(made) == (pytest.approx(110.0 - critical), "value", 2.0, 1)


def test_distance_on_a_bend_is_that_along_the_lane_of_who_comes(hand_made: Any) -> None:
    made = overtaken(hand_made)
    made.columns["detected"][0, :, 0, 0] = True
    for place in ("ego_place", "object_places"):
        made.columns[place][..., 2] = made.columns[place][..., 0] / 100.0
    behind = 84.0 * (100.0 - 8.75) / 100.0 - 4.0
    assert margin_behind(made)[0] == pytest.approx(behind - CRITICAL)
