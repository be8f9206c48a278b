"""Planted blindness: what a sensor cannot see is no track until physics lets it in."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from adeye.simulate.sensors import ranging
from adeye.simulate.world.weather import MM_PER_HOUR, camera_range, lidar_range
from adeye.spec.channels import NominalParameters
from tests.simulate.sensors import eyes
from tests.simulate.sensors.scenes import CAR

CLEAR = 1e9
RAIN = 7.5 * MM_PER_HOUR
CONFIRMED = NominalParameters().confirm_hits - 1
"""Ticks from the first sample with an actor to its track, at one sample a tick."""


def corners(size: tuple[float, float, float], place: eyes.Place) -> list[eyes.Place]:
    return [
        (place[0] + 0.5 * size[0] * a, place[1] + 0.5 * size[1] * b)
        for a in (-1.0, 1.0)
        for b in (-1.0, 1.0)
    ]


def bearings(size: tuple[float, float, float], place: eyes.Place) -> tuple[float, float]:
    """Bearing of the right and of the left edge of a box, seen from the origin [rad]."""
    angles = [math.atan2(y, x) for x, y in corners(size, place)]
    return min(angles), max(angles)


def check(
    eye: eyes.Eye,
    seen: eyes.Seen,
    actor: Callable[[float], eyes.Place],
    is_hidden: Callable[[float], bool],
    is_free: Callable[[float], bool],
) -> None:
    """Check that the actor is no track while it is hidden and is one soon after it is free."""
    times = [tick * eyes.STEP for tick in range(len(seen.tracks))]
    known = [
        eyes.knows(eye, tracks, actor(t)) for t, tracks in zip(times, seen.tracks, strict=True)
    ]
    hidden = [tick for tick, time in enumerate(times) if is_hidden(time)]
    free = [tick for tick, time in enumerate(times) if is_free(time)]
    # It is hidden from the start for half a second at least, long enough for a track.
    assert hidden == list(range(len(hidden)))
    assert len(hidden) >= 10
    assert free == list(range(free[0], len(times)))
    assert not any(known[: len(hidden)])
    latest = free[0] + CONFIRMED + eye.misses
    assert latest < len(times)
    assert known[latest]


def watch_behind_hider(model: str) -> None:
    """Check a sensor before which the hider moves off to the left after a second."""
    eye = eyes.EYES[model]

    def hider(time: float) -> eyes.Place:
        return eye.hider_x, max(0.0, 8.0 * (time - 1.0))

    def actor(_: float) -> eyes.Place:
        return eye.actor_x, 0.0

    right, left = bearings(eye.actor, actor(0.0))
    if not eye.tells_bearing:
        # The nearest echo drowns those behind it while any of the wall is in the cone.
        left = eye.half_view
    record = eyes.record_of(model)
    check(
        eye,
        eyes.drive(record, (eye.hider, eye.actor), lambda t: (hider(t), actor(t)), 50),
        actor,
        lambda time: bearings(eye.hider, hider(time))[0] <= right,
        lambda time: bearings(eye.hider, hider(time))[0] >= left,
    )


@pytest.mark.slow
@pytest.mark.parametrize("model", eyes.EYES)
def test_actor_behind_a_truck_is_no_track_until_the_truck_moves_off(model: str) -> None:
    watch_behind_hider(model)


@pytest.mark.parametrize("model", ["camera", "radar", "lidar"])
def test_law_of_the_truck_can_fail(model: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # A sensor that asks for no visible share of an object sees through whatever hides it; no file
    # can ask for such a one.
    numbers = ranging._numbers
    monkeypatch.setattr(ranging, "_numbers", lambda spec: numbers(spec) | {"min_visible": 0.0})
    with pytest.raises(AssertionError, match="not True"):
        watch_behind_hider(model)


@pytest.mark.parametrize("model", eyes.EYES)
def test_actor_in_a_blind_sector_is_no_track_until_it_enters_the_field_of_view(model: str) -> None:
    eye = eyes.EYES[model]
    way = 0.6 * eye.actor_x

    def actor(time: float) -> eyes.Place:
        bearing = 2.0 * eye.half_view - 0.4 * time
        return way * math.cos(bearing), way * math.sin(bearing)

    seen = eyes.drive(eyes.record_of(model), (eye.actor,), lambda time: (actor(time),), 60)
    check(
        eye,
        seen,
        actor,
        lambda time: bearings(eye.actor, actor(time))[0] >= eye.half_view,
        lambda time: bearings(eye.actor, actor(time))[1] <= eye.half_view,
    )


def rows_of_a_car(rows: float) -> float:
    """Distance at which a car is so many pixels high to the physical camera [m]."""
    record = eyes.EYES["camera/physical"].record
    return float(0.5 * record["columns"] / math.tan(math.radians(25.0)) * CAR[2] / rows)


CAMERA_REACH = camera_range(100.0, RAIN, CLEAR, 1.0)
LIDAR_REACH = lidar_range(100.0, 0.5, 0.9, RAIN, CLEAR)
REACHES: dict[str, tuple[dict[str, Any], float, float]] = {
    "camera": ({}, CAMERA_REACH, CAMERA_REACH),
    # Seven rows, a pixel more or less; in such rain it is pixels that it lacks, not contrast.
    "camera/physical": ({"min_pixel_height": 7}, rows_of_a_car(6.0), rows_of_a_car(8.0)),
    "radar": ({}, 100.0, 100.0),
    # Signals fluctuate: by far too weak, and strong enough for nearly every sample.
    "radar/physical": ({"range": "60 m"}, 150.0, 25.0),
    "lidar": ({}, LIDAR_REACH, LIDAR_REACH),
    # Its nearest face must reflect several beams, each a little further away than its middle.
    "lidar/physical": ({}, LIDAR_REACH, LIDAR_REACH - 0.1),
    "ultrasonic": ({}, 10.0, 10.0),
}
"""Changes to a record; beyond which distance it sees nothing in the rain, from where it does."""


@pytest.mark.parametrize("model", eyes.EYES)
def test_actor_beyond_range_in_rain_is_no_track_until_it_comes_nearer(model: str) -> None:
    eye = eyes.EYES[model]
    changes, blind, sees = REACHES[model]
    speed = 4.0 if model == "ultrasonic" else 15.0

    def face(time: float) -> float:
        return blind + 1.0 * speed - speed * time

    def actor(time: float) -> eyes.Place:
        return face(time) + 0.5 * eye.actor[0], 0.0

    ticks = 40 + int((blind - sees) / speed / eyes.STEP)
    seen = eyes.drive(
        eyes.record_of(model, **changes),
        (eye.actor,),
        lambda time: (actor(time),),
        ticks,
        closing=speed,
        rain=RAIN,
    )
    check(
        eye,
        seen,
        actor,
        lambda time: face(time) > blind + 1e-6,
        lambda time: face(time) <= sees - 1e-6,
    )


@pytest.mark.parametrize("model", ["camera", "lidar", "lidar/physical"])
def test_rain_alone_is_what_blinds_it(model: str) -> None:
    eye = eyes.EYES[model]
    place = (REACHES[model][1] + 1.0 + 0.5 * eye.actor[0], 0.0)
    drives = [
        eyes.drive(eyes.record_of(model), (eye.actor,), lambda _: (place,), 8, rain=rain)
        for rain in (0.0, RAIN)
    ]
    assert [eyes.knows(eye, seen.tracks[-1], place) for seen in drives] == [True, False]


def test_actor_on_dead_columns_is_no_track_until_it_moves_off_them() -> None:
    eye = eyes.EYES["camera/physical"]
    columns, focal = eye.record["columns"], 0.5 * eye.record["columns"] / math.tan(eye.half_view)
    # To 8 degrees on both sides of the axis.
    half = int(focal * math.tan(math.radians(8.0)))
    dead = {"column": columns // 2 - half, "columns": 2 * half, "rows": eye.record["rows"]}
    edge = math.atan2(half, focal)

    def actor(time: float) -> eyes.Place:
        return 20.0, max(0.0, 6.0 * (time - 0.6))

    def places(time: float) -> tuple[eyes.Place, ...]:
        return (actor(time),)

    record = eyes.record_of("camera/physical", patches={"dead": dead})
    check(
        eye,
        eyes.drive(record, (eye.actor,), places, 60),
        actor,
        lambda time: bearings(eye.actor, actor(time))[1] <= edge,
        lambda time: bearings(eye.actor, actor(time))[0] >= edge,
    )
    # A camera whose pixels are alive has it all the time.
    whole = eyes.drive(eyes.record_of("camera/physical"), (eye.actor,), places, 12)
    assert eyes.knows(eye, whole.tracks[-1], actor(0.0))


TURN = 20.0
"""By how much mounts are turned [deg]."""


def turned(place: eyes.Place, degrees: float) -> eyes.Place:
    angle = math.radians(degrees)
    c, s = math.cos(angle), math.sin(angle)
    return c * place[0] - s * place[1], s * place[0] + c * place[1]


def bearing_of(rows: Any) -> float:
    """Bearing of the nearest detection in the vehicle frame [deg]."""
    assert len(rows) == 1
    return math.degrees(math.atan2(rows[0, 1], rows[0, 0]))


@pytest.mark.parametrize("degrees", [TURN, -TURN])
@pytest.mark.parametrize("model", eyes.EYES)
def test_turned_mount_sees_a_turned_scene_as_a_straight_one(model: str, degrees: float) -> None:
    eye = eyes.EYES[model]
    # A person, because a camera takes cars to head as the ego does.
    place = (0.6 * eye.actor_x, 1.0)

    def look(yaw: float, at: eyes.Place, heading: float) -> Any:
        return eyes.drive(
            eyes.record_of(model, yaw=yaw),
            (eyes.PERSON,),
            lambda _: (at,),
            1,
            headings=lambda _: [math.radians(heading)],
        ).detections[0]

    straight, aside = look(0.0, place, 0.0), look(degrees, turned(place, degrees), degrees)
    # In the frame of the sensor both are one; in that of the vehicle the bearing has turned along.
    assert bearing_of(aside) - bearing_of(straight) == pytest.approx(degrees, abs=0.3)
    assert np.hypot(*aside[0]) == pytest.approx(np.hypot(*straight[0]), abs=0.2)
