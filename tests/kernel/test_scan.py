"""Beams: where they point, which may meet a box, and where they meet it."""

import math

import numpy as np
import pytest

from adeye.kernel import scan as subject
from adeye.kernel.sight import OUTLINE_WIDTH, Floats, outline, ray_box_distance

DEGREE = math.pi / 180.0


def beams_of(
    beams: int,
    field_of_view: float,
    *,
    layers: int = 1,
    vertical: float = 0.0,
    yaw: float = 0.0,
    pitch: float = 0.0,
) -> tuple[Floats, float]:
    table = np.zeros((subject.BEAM_WIDTH, beams * layers))
    departure = subject.fill_beams(yaw, pitch, field_of_view, vertical, beams, layers, table)
    return table, departure


def scan(
    table: Floats,
    box: tuple[float, float, float],
    size: tuple[float, float, float],
    *,
    height: float = 0.5,
    heading: float = 0.0,
    level: bool = False,
) -> Floats:
    """Cast every beam of a sensor in the origin at one box; return how far each gets."""
    look = np.zeros(OUTLINE_WIDTH)
    outline(0.0, 0.0, np.array(box), np.array(size), look)
    count = table.shape[1]
    nearest, who = np.full(count, np.inf), np.full(count, -1)
    cast = subject.scan_box_level if level else subject.scan_box
    sine, cosine = math.sin(heading), math.cos(heading)
    cast(look, np.array(size), sine, cosine, height, table, 0, count - 1, 7, nearest, who)
    assert np.array_equal(who == 7, np.isfinite(nearest))
    return nearest


# --- directions -----------------------------------------------------------------------------------


def test_beams_of_a_whole_turn_stand_evenly_and_none_twice() -> None:
    table, departure = beams_of(8, 2.0 * math.pi)
    assert departure == 0.0
    steps = np.diff(table[subject.BEAM_BEARING])
    assert steps == pytest.approx(np.full(7, 45.0 * DEGREE))
    assert table[subject.BEAM_BEARING].sum() == pytest.approx(0.0)
    assert table[subject.BEAM_X] == pytest.approx(np.cos(table[subject.BEAM_BEARING]))
    assert table[subject.BEAM_Y] == pytest.approx(np.sin(table[subject.BEAM_BEARING]))


def test_pitched_beams_are_those_of_a_turn_about_the_left_axis() -> None:
    yaw, vertical, field = 0.7, 0.4, 2.0
    # Layers stand from the lower edge to the upper one, beams in the middle of their parts.
    elevation = np.repeat([-0.5 * vertical, 0.0, 0.5 * vertical], 11)
    angle = np.tile(((np.arange(11) + 0.5) / 11 - 0.5) * field, 3)
    x, y = np.cos(elevation) * np.cos(angle), np.cos(elevation) * np.sin(angle)
    z = np.sin(elevation)
    for pitch in (0.0, 0.3):
        table, departure = beams_of(11, field, layers=3, vertical=vertical, pitch=pitch, yaw=yaw)
        ahead = math.cos(pitch) * x + math.sin(pitch) * z
        up = math.cos(pitch) * z - math.sin(pitch) * x
        bearings, elevations = table[subject.BEAM_BEARING], table[subject.BEAM_ELEVATION]
        assert bearings == pytest.approx(yaw + np.arctan2(y, ahead))
        assert elevations == pytest.approx(np.arcsin(up))
        assert departure == pytest.approx(np.abs(bearings - yaw - angle).max())
        assert table[subject.BEAM_SLOPE] == pytest.approx(np.tan(elevations))
        assert table[subject.BEAM_SECANT] == pytest.approx(1.0 / np.cos(elevations))


def test_beam_straight_down_has_a_finite_slope() -> None:
    table, _ = beams_of(1, 1.0, pitch=0.5 * math.pi)
    assert table[subject.BEAM_ELEVATION, 0] == pytest.approx(-0.5 * math.pi)
    assert np.isfinite(table).all()


# --- which beams may meet a box -------------------------------------------------------------------


def test_interval_of_beams_holds_all_between_two_angles_and_no_other() -> None:
    table, _ = beams_of(36, 2.0 * math.pi)
    angles = table[subject.BEAM_BEARING]
    for right, left in ((-0.3, 0.41), (1.0, 1.2), (0.01, 0.02), (-4.0, 4.0), (3.0, 3.5)):
        first, last = subject.beams_between(right, left, 2.0 * math.pi, 36)
        inside = np.flatnonzero((angles >= right) & (angles <= left)).tolist()
        assert list(range(first, last + 1)) == inside


def test_no_beam_is_outside_of_the_field_of_view() -> None:
    first, last = subject.beams_between(1.0, 2.0, 1.0, 10)
    assert last < first
    assert subject.beams_between(-3.0, 3.0, 1.0, 10) == (0, 9)


# --- where they meet it ---------------------------------------------------------------------------


@pytest.mark.parametrize("level", [False, True])
def test_wall_ahead_is_at_its_distance_over_the_cosine(level: bool) -> None:  # noqa: FBT001
    table, _ = beams_of(31, 60.0 * DEGREE)
    found = scan(table, (12.0, 0.0, 0.0), (4.0, 100.0, 2.0), level=level)
    assert found == pytest.approx(10.0 / np.cos(table[subject.BEAM_BEARING]))


def test_level_beams_meet_what_any_beams_meet() -> None:
    table, _ = beams_of(720, 2.0 * math.pi, yaw=0.4)
    for box in ((8.0, 3.0, 0.3), (-6.0, -4.0, 2.0), (0.5, 12.0, -1.0), (1.0, 0.5, 0.2)):
        size, heading = (4.5, 1.8, 1.5), 0.25
        plain = scan(table, box, size, heading=heading)
        assert np.array_equal(plain, scan(table, box, size, heading=heading, level=True))
        angles = table[subject.BEAM_BEARING] + heading
        single = [
            ray_box_distance((0.0, 0.0), (math.cos(a), math.sin(a)), (*box, *size[:2]))
            for a in angles
        ]
        assert plain == pytest.approx(np.array(single))


def test_beam_along_a_side_hits_inside_its_width_only() -> None:
    table = np.zeros((subject.BEAM_WIDTH, 1))
    table[subject.BEAM_X], table[subject.BEAM_SECANT] = 1.0, 1.0
    assert scan(table, (10.0, 0.9, 0.0), (4.0, 2.0, 1.5))[0] == 8.0
    assert math.isinf(scan(table, (10.0, 1.1, 0.0), (4.0, 2.0, 1.5))[0])


def test_nearer_box_wins_whatever_the_order() -> None:
    table, _ = beams_of(1, 0.1)
    size, nearest, who = np.array([2.0, 2.0, 2.0]), np.full(1, np.inf), np.zeros(1, dtype=np.int64)
    for thing, x in ((1, 20.0), (2, 10.0), (3, 30.0)):
        look = np.zeros(OUTLINE_WIDTH)
        outline(0.0, 0.0, np.array([x, 0.0, 0.0]), size, look)
        subject.scan_box(look, size, 0.0, 1.0, 0.5, table, 0, 0, thing, nearest, who)
    assert (who[0], nearest[0]) == (2, pytest.approx(9.0))


def test_beam_passes_over_a_box_that_is_lower_than_it() -> None:
    table, _ = beams_of(1, 0.1)
    for level in (False, True):
        assert math.isinf(
            scan(table, (10.0, 0.0, 0.0), (2.0, 2.0, 1.0), height=1.01, level=level)[0]
        )
        assert scan(table, (10.0, 0.0, 0.0), (2.0, 2.0, 1.0), height=0.99, level=level)[0] == 9.0


def test_falling_beam_meets_the_roof_of_a_box_that_is_lower_than_the_sensor() -> None:
    # From 2 m it falls 0.1 m per metre: at 10 m it is 1 m high, inside the box of 9 m to 11 m.
    table, _ = beams_of(1, 0.1, pitch=math.atan(0.1))
    assert scan(table, (10.0, 0.0, 0.0), (2.0, 2.0, 1.0), height=2.0)[0] == pytest.approx(10.0)
    # Its rear is higher than the beam there; beyond its front the beam is higher.
    assert scan(table, (10.0, 0.0, 0.0), (2.0, 2.0, 1.2), height=2.0)[0] == pytest.approx(9.0)
    assert math.isinf(scan(table, (10.0, 0.0, 0.0), (2.0, 2.0, 0.8), height=2.0)[0])


def test_falling_beam_that_has_met_the_ground_meets_no_box_beyond() -> None:
    table, _ = beams_of(1, 0.1, pitch=math.atan(0.1))
    assert math.isinf(scan(table, (30.0, 0.0, 0.0), (2.0, 2.0, 3.0), height=2.0)[0])


def test_rising_beam_passes_over_far_boxes_only() -> None:
    table, _ = beams_of(1, 0.1, pitch=-math.atan(0.1))
    assert scan(table, (6.0, 0.0, 0.0), (2.0, 2.0, 1.5))[0] == pytest.approx(5.0)
    assert math.isinf(scan(table, (16.0, 0.0, 0.0), (2.0, 2.0, 1.5))[0])


@pytest.mark.slow
def test_sensor_inside_of_a_box_sees_nothing_else() -> None:
    table, _ = beams_of(4, 2.0 * math.pi)
    assert scan(table, (0.5, 0.0, 0.3), (4.0, 2.0, 2.0)).tolist() == [0.0] * 4
