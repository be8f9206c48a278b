"""Fields of view and what the own body hides, in hand-made places."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.analysis.suite.geometry import Reach, View, distance, free_way, looks_at, sees
from tests.analysis.suite.rigs import BUMPER, FRONT, ROOF, WIDTH, view

TURN = 2.0 * math.pi


def looks(eye: View, x: float, y: float) -> bool:
    return bool(looks_at(eye, np.array([x]), np.array([y]))[0])


def mount(x: float, y: float, z: float, yaw: float = 0.0) -> dict[str, float]:
    return {"x": x, "y": y, "z": z, "yaw": yaw}


def test_edge_of_the_field_of_view_is_half_of_it_to_each_side() -> None:
    eye = view(field_of_view=math.radians(40.0))
    for side in (1.0, -1.0):
        for degrees, expected in ((19.9, True), (20.1, False)):
            angle = side * math.radians(degrees)
            x, y = FRONT + 50.0 * math.cos(angle), 50.0 * math.sin(angle)
            assert looks(eye, x, y) is expected


def test_yaw_turns_the_field_of_view() -> None:
    eye = view(field_of_view=0.2, mount=mount(0.0, 0.0, 2.0, math.pi / 2.0))
    assert looks(eye, 0.0, 30.0)
    assert not looks(eye, 30.0, 0.0)


def test_sensor_on_the_roof_sees_all_around() -> None:
    eye = view(field_of_view=TURN, mount=ROOF)
    assert eye.body is None
    for x, y in ((30.0, 0.0), (-30.0, 0.0), (0.0, 3.0), (0.0, -3.0), (-2.5, 0.0)):
        assert looks(eye, x, y)


def test_sensor_at_the_front_sees_ahead_of_the_front_only() -> None:
    eye = view(field_of_view=TURN, mount=BUMPER)
    assert looks(eye, FRONT + 0.1, 50.0)
    assert looks(eye, FRONT + 0.1, -50.0)
    assert not looks(eye, FRONT - 0.1, 3.0)
    assert not looks(eye, -30.0, 0.0)


def test_sensor_a_hand_behind_the_bumper_looks_out_over_it_alike() -> None:
    eye = view(field_of_view=TURN, mount=mount(FRONT - 0.15, 0.0, 0.5))
    assert looks(eye, FRONT + 0.1, 20.0)
    assert not looks(eye, -30.0, 0.0)


def test_sensor_at_a_corner_sees_three_quarters_around() -> None:
    eye = view(field_of_view=TURN, mount=mount(FRONT, 0.5 * WIDTH, 0.5))
    assert looks(eye, 30.0, 0.0)
    assert looks(eye, -30.0, 0.5 * WIDTH + 0.1)
    assert looks(eye, FRONT + 0.1, -30.0)
    assert not looks(eye, 0.0, -30.0)
    assert not looks(eye, -30.0, -5.0)


def test_camera_behind_the_windscreen_looks_out_ahead_only() -> None:
    eye = view(field_of_view=math.radians(170.0), mount=mount(1.5, 0.0, 1.3))
    assert looks(eye, 50.0, 0.0)
    assert looks(eye, 5.0, 10.0)
    behind = view(field_of_view=TURN, mount=mount(1.5, 0.0, 1.3))
    assert not looks(behind, -30.0, 0.0)
    assert not looks(behind, 1.0, 5.0)


def test_camera_behind_the_rear_window_looks_out_behind() -> None:
    eye = view(field_of_view=1.5, mount=mount(-1.5, 0.0, 1.3, math.pi))
    assert looks(eye, -30.0, 0.0)
    assert not looks(eye, 30.0, 0.0)


def test_mirror_outside_of_the_body_does_not_see_through_it() -> None:
    eye = view(field_of_view=TURN, mount=mount(0.5, 0.5 * WIDTH + 0.5, 1.0))
    assert looks(eye, -30.0, 2.0)
    assert looks(eye, 0.5, 10.0)
    assert not looks(eye, 0.5, -10.0)
    assert looks(eye, 30.0, -1.0)


@given(
    x=st.floats(-2.4, 2.4), y=st.floats(-0.9, 0.9), yaw=st.floats(-3.1, 3.1),
    angle=st.floats(-3.1, 3.1),
)  # fmt: skip
def test_who_is_seen_from_afar_is_seen_from_the_edge_on(
    x: float, y: float, yaw: float, angle: float
) -> None:
    """A ray that has left the body does not come back: hidden is a matter of bearing alone."""
    eye = view(field_of_view=TURN, mount=mount(x, y, 0.5, yaw))
    ways = np.array([8.0, 20.0, 100.0])
    seen = looks_at(eye, x + ways * math.cos(angle), y + ways * math.sin(angle))
    assert seen.all() or not seen.any()


def test_free_way_ends_at_the_body() -> None:
    eye = view(field_of_view=TURN, mount=mount(0.0, 3.0, 1.0))
    found = free_way(eye, np.array([0.0, 0.0, 1.0]), np.array([-1.0, 1.0, 0.0]))
    assert found[0] == pytest.approx(3.0 - 0.5 * WIDTH)
    assert found[1:].tolist() == [math.inf, math.inf]


def test_range_is_measured_from_the_mount() -> None:
    eye = view(mount=BUMPER)
    x, y = np.array([FRONT + 50.0, FRONT + 50.1]), np.zeros(2)
    assert distance(eye, x, y) == pytest.approx([50.0, 50.1])
    assert sees(eye, Reach(0.0, 50.0), x, y).tolist() == [True, False]
    assert sees(eye, Reach(50.05, 60.0), x, y).tolist() == [False, True]
    assert sees(eye, Reach(0.0, 0.0), np.array([FRONT]), np.zeros(1)).tolist() == [False]
