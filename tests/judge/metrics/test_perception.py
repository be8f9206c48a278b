"""First detection, what matters, and who comes from behind, over hand-made runs."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS
from adeye.judge.metrics.perception import measuring_sensors
from adeye.kernel.encounter import reachable_distance
from adeye.trace import NO_TRACKS
from tests.judge.conftest import HandMade, measure

COLUMN = "first_detection_distance_m"


def first_detection(made: Any) -> Any:
    return measure(made, COLUMN)


def standing(*objects: str, rows: int = 21) -> HandMade:
    """A standing wall, 96 m ahead from body to body; the ego drives 2 m from row to row."""
    return HandMade(objects=objects or ("wall",), rows=rows).object("wall", s=100.0, speed=0.0)


def seen(made: HandMade, *rows: int, sensor: int = 0) -> HandMade:
    """Let a sensor detect each object from a row on."""
    for thing, row in enumerate(rows):
        made.columns["detected"][0, row:, sensor, thing] = True
    return made


def test_distance_is_that_of_the_first_row_with_a_detection() -> None:
    # The lead leaves the path and shows the wall behind it.
    leaves = np.where(np.arange(21) < 10, 5.25, 8.75)
    last = seen(standing("lead", "wall").object("lead", d=leaves), 0, 12)
    both = seen(standing("lead", "wall").object("lead", d=leaves), 3, 3)
    for why, made, value, time, actor in (
        ("found in row 4", seen(standing(), 4), 88.0, 0.4, 0),
        ("never found is found at 0", standing(), 0.0, 2.0, 0),
        ("ground truth does not detect", seen(standing(), 0, sensor=1), 0.0, 2.0, 0),
        ("who is found last counts", last, 72.0, 1.2, 1),
        ("the nearer of two found together", both, 40.0, 0.3, 0),
    ):
        expected = (pytest.approx(value), "value", pytest.approx(time), actor)
        assert first_detection(made) == expected, why


def test_object_beside_the_path_does_not_matter_and_an_unknown_place_is_an_error() -> None:
    assert first_detection(seen(standing().object("wall", d=8.75), 4))[1] == "not_applicable"
    made = standing()
    made.columns["objects"][0, 3, 0, 0] = np.nan
    assert first_detection(made)[1] == "error"


def test_sensor_without_a_link_does_not_count(architecture: Any) -> None:
    trace = standing().trace()
    assert measuring_sensors(trace.layout) == (0,)
    channels = {"safety": {"kind": "safety", "links": ["truth"], "rate": "10 Hz"}}
    switch = {"policy": "stuck", "priority": ["safety"], "default": "safety"}
    object.__setattr__(trace.layout, "architecture", architecture(channels=channels, switch=switch))
    assert measuring_sensors(trace.layout) == ()
    assert METRICS[COLUMN].compute(trace).status == ("not_applicable",)


REACH = reachable_distance(20.0, 1.0)
"""Of the ego, which drives 2 m from row to row [m]."""
MATTERS_FROM = 22
"""First row of ``approach`` at which the wall is no farther than that."""


def nearing(*objects: str) -> HandMade:
    return standing(*objects, rows=41)


def latency(made: HandMade) -> Any:
    return measure(made, "detection_latency_s")


def test_scene_of_these_tests_is_as_they_say() -> None:
    assert 96.0 - 2.0 * (MATTERS_FROM - 1) > REACH >= 96.0 - 2.0 * MATTERS_FROM


# --- latency --------------------------------------------------------------------------------------


def test_latency_counts_from_when_the_object_matters_to_its_detection() -> None:
    late = seen(nearing(), MATTERS_FROM + 4)
    time = pytest.approx(0.1 * (MATTERS_FROM + 4))
    assert latency(late) == (pytest.approx(0.4), "value", time, 0)
    # What is seen before it matters is not late.
    assert latency(seen(nearing(), 3))[:2] == (0.0, "value")
    # What nobody detects is late to the end; ground truth detects nothing.
    to_the_end = pytest.approx(0.1 * (40 - MATTERS_FROM))
    for made in (nearing(), seen(nearing(), 0, sensor=1)):
        value, status, _, actor = latency(made)
        assert (value, status, actor) == (to_the_end, "incomplete", 0)


def test_detected_object_does_not_stand_for_one_that_is_not() -> None:
    # The lead is found late; the wall behind it matters at the end, for less time.
    made = nearing("lead", "wall")
    made.object("lead", d=np.where(np.arange(41) < 34, 5.25, 8.75), s=30.0 + 2.0 * np.arange(41))
    made.object("wall", s=115.0)
    made.columns["detected"][0, 9:, 0, 0] = True
    made.horizon_row[:] = 34
    found = (pytest.approx(0.9), "incomplete", pytest.approx(0.9), 0)
    assert measure(made, "detection_latency_s") == found
    # What begins to matter after the horizon asks for nothing.
    made.horizon_row[:] = 33
    assert measure(made, "detection_latency_s")[1] == "value"


def test_far_object_does_not_matter_but_on_a_slippery_road_nor_does_one_beside_the_path() -> None:
    made = nearing().object("wall", s=4.0 + 80.0 + REACH + 0.1)
    for column in ("detection_latency_s", "missed_time_s"):
        assert measure(made, column)[1] == "not_applicable"
    trace = made.trace()
    trace.layout.context.surroundings.friction[:] = 0.5
    assert METRICS["detection_latency_s"].compute(trace).status == ("value",)
    assert latency(nearing().object("wall", d=8.75))[1] == "not_applicable"


def test_hidden_object_matters_when_half_of_it_comes_out() -> None:
    # A screen 9 m ahead, beside the path; a pedestrian at 18 m walks out from behind it.
    made = nearing("screen", "wall")
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


def test_latest_of_several_objects_counts() -> None:
    # The lead leaves the path at row 30 and shows the wall behind it.
    made = nearing("lead", "wall")
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


def test_unknown_place_is_an_error_of_all() -> None:
    made = nearing()
    made.columns["objects"][0, 3, 0, 0] = np.nan
    for column in (
        "detection_latency_s",
        "missed_time_s",
        "range_error_rms_m",
        "rear_detection_margin_m",
    ):
        assert measure(made, column)[1] == "error", column


# --- missed and false tracks ----------------------------------------------------------------------


def tracked(made: HandMade, rows: Any = slice(None), *, channel: int = 0) -> HandMade:
    """Let a channel have a track of the wall."""
    made.columns["track_error"][0, rows, channel, 0] = 0.1
    return made


def test_missed_time_counts_the_rows_without_a_track() -> None:
    made = tracked(nearing(), slice(MATTERS_FROM + 5, None))
    made.columns["track_error"][0, MATTERS_FROM + 8, 0, 0] = np.nan
    expected = (pytest.approx(0.6), "value", pytest.approx(0.1 * MATTERS_FROM), 0)
    assert measure(made, "missed_time_s") == expected
    # What is tracked all the time, or as long as it matters, is not missed.
    for rows in (slice(None), slice(MATTERS_FROM, None)):
        assert measure(tracked(nearing(), rows), "missed_time_s")[:2] == (0.0, "value")
    # The track of another channel helps nobody.
    other = measure(tracked(nearing(), channel=1), "missed_time_s")
    assert other[0] == pytest.approx(0.1 * (40 - MATTERS_FROM))


def test_channel_that_shows_no_tracks_is_not_judged_unless_it_stops_to_show_them() -> None:
    never, stops = nearing(), nearing()
    never.columns["false_tracks"][:, :, 0] = NO_TRACKS
    for column in ("missed_time_s", "false_track_time_s"):
        assert measure(never, column)[1] == "not_applicable"
    stops.columns["false_tracks"][:, 1:, 0] = NO_TRACKS
    assert measure(stops, "missed_time_s")[1] == "value"


def test_false_track_time_counts_rows_not_tracks() -> None:
    assert measure(nearing(), "false_track_time_s")[:2] == (0.0, "value")
    made = nearing()
    made.columns["false_tracks"][0, 7:10, 0] = (1, 2, 1)
    made.columns["false_tracks"][0, :, 1] = 1
    expected = (pytest.approx(0.3), "value", pytest.approx(0.7), -1)
    assert measure(made, "false_track_time_s") == expected


# --- errors ---------------------------------------------------------------------------------------


def test_range_error_is_the_root_of_the_mean_square() -> None:
    made = nearing()
    # Before it is within reach the error is huge and does not count.
    made.columns["track_error"][0, :MATTERS_FROM, 0, 0] = 50.0
    made.columns["track_error"][0, 30, 0, 0] = (-3.0, 9.0)
    made.columns["track_error"][0, 31, 0, 0] = (4.0, 9.0)
    expected = (pytest.approx(math.sqrt(12.5)), "value", pytest.approx(3.1), 0)
    assert measure(made, "range_error_rms_m") == expected


def test_position_error_is_what_nineteen_of_twenty_rows_keep() -> None:
    made = nearing().object("wall", s=4.0 + 96.0 - 40.0)
    sizes = np.arange(1.0, 21.0)
    made.columns["track_error"][0, 2:22, 0, 0, 0] = 0.6 * sizes[::-1]
    made.columns["track_error"][0, 2:22, 0, 0, 1] = 0.8 * sizes[::-1]
    expected = (pytest.approx(19.0), "value", pytest.approx(0.2), 0)
    assert measure(made, "position_error_p95_m") == expected


def test_without_a_track_there_is_no_error_to_tell() -> None:
    assert measure(nearing(), "range_error_rms_m")[1] == "not_applicable"
    assert measure(nearing(), "position_error_p95_m")[1] == "not_applicable"


CRITICAL = 10.0 * 0.4 + 10.0**2 / 6.0 + 20.0
"""What somebody 10 m/s faster than the ego's 20 m/s needs [m]."""


def margin_behind(made: Any) -> Any:
    return measure(made, "rear_detection_margin_m")


def overtaken(*objects: str, behind: float = 80.0) -> Any:
    """Somebody 10 m/s faster in the left lane, who gains 1 m from row to row."""
    made = HandMade(objects=objects or ("fast",), rows=101)
    return made.object("fast", s=3.0 * np.arange(101) - behind - 4.0, speed=30.0, d=8.75)


def test_margin_is_the_distance_of_the_first_detection_less_the_critical() -> None:
    found = margin_behind(seen(overtaken(), 20))
    assert found == (pytest.approx(60.0 - CRITICAL), "value", 2.0, 0)
    # Who is never seen, alongside only, or by ground truth, is at zero.
    for made in (overtaken(), seen(overtaken(), 81), seen(overtaken(), 0, sensor=1)):
        assert margin_behind(made)[:2] == (pytest.approx(-CRITICAL), "value")


def test_who_is_too_near_from_the_start_does_not_count() -> None:
    assert margin_behind(overtaken(behind=CRITICAL - 0.5))[1] == "not_applicable"
    assert margin_behind(overtaken(behind=CRITICAL + 0.5))[1] == "value"


def test_who_does_not_come_from_behind_in_the_next_lane_does_not_count() -> None:
    for why, change in (
        ("slower", {"speed": 19.0}),
        ("in the lane of the ego", {"d": 5.25}),
        ("two lanes away", {"d": 5.25 + 1.5 * 3.5 + 0.1}),
        ("ahead", {"s": 50.0 + 3.0 * np.arange(101)}),
    ):
        assert margin_behind(overtaken().object("fast", **change))[1] == "not_applicable", why


def test_worst_of_two_counts() -> None:
    made = overtaken("fast", "faster")
    made.object("faster", s=4.0 * np.arange(101) - 154.0, speed=40.0, d=1.75)
    made.columns["detected"][0, 20:, 0, :] = True
    critical = 20.0 * 0.4 + 20.0**2 / 6.0 + 20.0
    assert margin_behind(made) == (pytest.approx(110.0 - critical), "value", 2.0, 1)


def test_distance_on_a_bend_is_that_along_the_lane_of_who_comes() -> None:
    made = overtaken()
    made.columns["detected"][0, :, 0, 0] = True
    for place in ("ego_place", "object_places"):
        made.columns[place][..., 2] = made.columns[place][..., 0] / 100.0
    behind = 84.0 * (100.0 - 8.75) / 100.0 - 4.0
    assert margin_behind(made)[0] == pytest.approx(behind - CRITICAL)
