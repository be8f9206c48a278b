"""What a reference driver knows of objects: speeds from places, and who hides whom."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.kernel.reference_drivers.parameters import CUE, GAP, LATERAL_GAP, VIEW_SIZE
from adeye.kernel.road import position
from adeye.simulate.channels.perception.pose import (
    POSE_ALIGN,
    POSE_D,
    POSE_HEADING,
    POSE_S,
    POSE_SPEED,
    POSE_WIDTH,
    POSE_X,
    POSE_Y,
)
from adeye.simulate.channels.reference import (
    THING_ACCELERATION,
    THING_FORWARD,
    THING_HITS,
    THING_S,
    THING_SIDEWAYS,
    THING_SIZE,
    THINGS,
    UNSEEN,
    VISIBLE,
    look_at,
    update_things,
)
from adeye.testing.scenes import straight_road

if TYPE_CHECKING:
    from adeye.signals import Floats

PERIOD = 0.05
LANE = 5.25
RECORD: Any = np.array(
    [(4.5, 1.8, 3.5)], dtype=[("length", "f8"), ("width", "f8"), ("lane_width", "f8")]
)[0]


def pose(speed: float = 20.0) -> Floats:
    row = np.zeros(POSE_WIDTH)
    row[[POSE_S, POSE_X]] = 500.0
    row[[POSE_D, POSE_Y]] = LANE
    row[[POSE_ALIGN, POSE_HEADING]] = 0.0
    row[POSE_SPEED] = speed
    return row


def see(things: Floats, *places: tuple[float, float]) -> None:
    """Show objects at places relative to an ego that stays where it is."""
    rows = np.array([[x, y, 0.0, 0.0, 4.5, 1.8, 0.0] for x, y in places]).reshape(-1, 7)
    segments = straight_road().segments[0]
    update_things(things, pose(), segments, LANE, np.ones(len(rows), bool), rows, PERIOD)


def nothing() -> Floats:
    return np.zeros((THINGS, THING_SIZE))


def row_at(things: Floats, x: float) -> int:
    return int(np.argmin(np.abs(things[:, THING_S] - 500.0 - x)))


@pytest.mark.slow
def test_speed_and_acceleration_follow_from_places() -> None:
    things = nothing()
    for tick in range(5):
        time = tick * PERIOD
        see(things, (30.0 + 10.0 * time - 2.0 * time * time, 1.0 - 0.5 * time))
    thing = things[0]
    assert thing[THING_FORWARD] == pytest.approx(10.0 - 4.0 * 0.2, abs=1e-6)
    assert thing[THING_ACCELERATION] == pytest.approx(-4.0, abs=1e-6)
    assert thing[THING_SIDEWAYS] == pytest.approx(-0.5, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_gap_and_speed_in_a_bend_are_those_along_the_lane(side: float) -> None:
    """The ego is still on the straight, the lead in the bend of 60 m that begins 10 m ahead."""
    segments = np.array(
        [[0.0, 0.0, 0.0, 510.0, 0.0], [510.0, 0.0, 0.0, 150.0, side / 60.0]]
    )  # fmt: skip
    things, view, here = nothing(), np.zeros(VIEW_SIZE), pose()
    radius = 60.0 - side * LANE
    for tick in range(3):
        way = 40.0 + 12.0 * tick * PERIOD
        x, y, _ = position(segments, 510.0 + (way - 10.0) * 60.0 / radius, LANE)
        rows = np.array([[x - 500.0, y - LANE, 0.0, 0.0, 4.5, 1.8, 0.0]])
        update_things(things, here, segments, LANE, np.ones(1, bool), rows, PERIOD)
    assert things[0, THING_FORWARD] == pytest.approx(12.0, abs=1e-4)
    look_at(RECORD, things, 0, here, LANE, view)
    assert view[GAP] == pytest.approx(way - 4.5, abs=1e-4)


def test_what_is_gone_is_forgotten() -> None:
    things = nothing()
    see(things, (30.0, 0.0))
    see(things)
    assert (things[:, THING_HITS] == 0.0).all()


def test_objects_keep_their_rows_when_their_order_changes() -> None:
    things = nothing()
    see(things, (20.0, 3.5), (21.0, -3.5))
    # Both are taken to be as fast as the ego at first, a metre further on.
    see(things, (21.6, -3.5), (22.0, 3.5))
    assert things[0, THING_S] == pytest.approx(522.0)
    assert things[1, THING_S] == pytest.approx(521.6)


@pytest.mark.slow
def test_a_vehicle_ahead_hides_the_next_until_it_leaves() -> None:
    things, view = nothing(), np.zeros(VIEW_SIZE)
    for _ in range(3):
        see(things, (20.0, 0.0), (60.0, 0.0))
        seen = [look_at(RECORD, things, row, pose(), LANE, view) for row in range(2)]
    assert seen == [VISIBLE, 0]
    for tick in range(1, 6):
        see(things, (20.0, 0.1 * tick), (60.0, 0.0))
        seen = [look_at(RECORD, things, row, pose(), LANE, view) for row in range(2)]
        assert seen == [VISIBLE, VISIBLE if 0.1 * tick > 0.375 else 0]
    assert view[CUE] == pytest.approx(0.5)
    assert view[GAP] == pytest.approx(55.5)
    assert view[LATERAL_GAP] == pytest.approx(-1.8)


def test_what_is_behind_is_not_looked_at() -> None:
    things, view = nothing(), np.zeros(VIEW_SIZE)
    for _ in range(3):
        see(things, (-20.0, 0.0))
    assert look_at(RECORD, things, row_at(things, -20.0), pose(), LANE, view) == UNSEEN
