"""A second implementation of the scenes, one at a time, from what the regulation says.

Written without the product: positions along a road instead of gaps, moments instead of counters.
"""

from __future__ import annotations

from typing import NamedTuple

from tests.reference_models import DRIVERS, LANE, LENGTH, NO_VARIANT, WIDTH, Driver, Seen

END_S = 300.0

APART = float("-inf")
"""What a scene without contact gives instead of the speed of the impact, which is negative where
the side of a vehicle is touched while the gap opens."""


class CutIn(NamedTuple):
    """Speeds [m/s], gap [m], speed of the change from one lane's centre to the next [m/s], width of
    the lanes [m]."""

    ego: float
    other: float
    gap: float
    sideways: float
    lane: float = LANE


class CutOut(NamedTuple):
    """Speeds [m/s], gap to the lead (None: the driver's own) and from it to the standing one [m],
    speed of the change of lane [m/s]."""

    ego: float
    lead: float
    gap: float | None
    front: float
    sideways: float


class Braking(NamedTuple):
    """Speeds [m/s], gap [m] (None: the driver's own); the lead's braking [m/s^2], jerk [m/s^3]."""

    ego: float
    lead: float
    gap: float | None
    braking: float
    jerk: float


Outcome = float | None
"""Speed of the impact [m/s], ``APART``, or None after 300 s."""


def cut_in(scene: CutIn, driver: Driver, step: float) -> Outcome:
    """Let a driver meet a vehicle that cuts in."""
    speed, other, gap, sideways, lane = scene
    is_ended = isinstance(driver, DRIVERS["cc"]) and "jrc-ttc-end" in driver.variant
    place = 0.0
    start = gap + LENGTH
    acceleration = 0.0
    tick = 0
    while (time := tick * step) <= END_S:
        across = lane - sideways * time
        moving = sideways
        if across <= 0.0:
            across = moving = 0.0
        distance = start + other * time - place - LENGTH
        beside = across - WIDTH
        closing = speed - other
        if distance <= 0.0:
            if distance <= -2 * LENGTH:
                return APART
            if beside < 0.0:
                return closing
        off_centre = lane - across if moving > 0.0 else 0.0
        seen = Seen(time, speed, acceleration, other, 0.0, distance, beside, moving, off_centre)
        force = driver.force(seen)
        if speed <= 0.0 or (distance > 0.0 and closing <= 0.0):
            return APART
        if closing < 0.01 and driver.braking and distance > 0.0 and beside <= 0.0:
            return APART
        far = abs(distance) > 2.0 * abs(closing)
        if is_ended and beside <= 0.0 and distance >= driver.back and far:
            return APART
        past = speed
        if force > 0.0:
            until = min(step, speed / force)
            place += speed * until - force * until * until / 2.0
            speed = max(0.0, speed - force * step)
        else:
            place += speed * step
        acceleration = (speed - past) / step
        tick += 1
    return None


def braking_lead(scene: Braking, driver: Driver, step: float) -> Outcome:
    """Let a driver follow a lead that brakes."""
    speed, lead, gap, most, jerk = scene
    place = 0.0
    rear = driver.follows_at(speed) if gap is None else gap
    acceleration = slowing = 0.0
    tick = 0
    while (time := tick * step) <= END_S:
        distance = rear - place
        closing = speed - lead
        if distance <= 0.0:
            return closing if distance > -2 * LENGTH else APART
        seen = Seen(time, speed, acceleration, lead, slowing, distance, -WIDTH, 0.0, 0.0)
        force = driver.force(seen)
        if speed <= 0.0:
            return APART
        if most <= 0.0 or lead <= 0.0:
            settled = closing < 0.01 and slowing == 0.0 and driver.braking
            if closing <= 0.0 or settled:
                return APART
        way, slower = roll(speed, force, step)
        place += way
        acceleration, speed = (slower - speed) / step, slower
        way, slower = roll(lead, min(most, jerk * (time + step / 2.0)), step)
        rear += way
        slowing, lead = (lead - slower) / step, slower
        tick += 1
    return None


def cut_out(scene: CutOut, driver: Driver, step: float) -> Outcome:
    """Let a driver follow a lead that leaves before a standing vehicle."""
    speed, lead, gap, front, sideways = scene
    place = 0.0
    start = driver.follows_at(speed) if gap is None else gap
    standing = start + LENGTH + front
    acceleration = slowing = 0.0
    rear, across = start, 0.0
    revealed = hit = False
    tick = 0
    while (time := tick * step) <= END_S:
        if not hit:
            rear = start + scene.lead * time
            across = sideways * time
            hit = rear + LENGTH >= standing and across < WIDTH
            revealed = revealed or across > 0.375
        if hit:
            revealed = False
            # It stands at once, which is seen as braking over one step.
            slowing, lead = (lead - 0.0) / step, 0.0
        if across < WIDTH and -2 * LENGTH < rear - place <= 0.0:
            return speed - lead
        if revealed:
            distance, beside, other, slow, moving = standing - place, -WIDTH, 0.0, 0.0, 0.0
            if -2 * LENGTH < distance <= 0.0:
                return speed
        else:
            distance, beside, other, slow = rear - place, across - WIDTH, lead, slowing
            moving = 0.0 if hit else -sideways
        seen = Seen(time, speed, acceleration, other, slow, distance, beside, moving, across)
        force = driver.force(seen)
        if speed <= 0.0 or distance <= -2 * LENGTH:
            return APART
        way, slower = roll(speed, force, step)
        place += way
        acceleration, speed = (slower - speed) / step, slower
        tick += 1
    return None


def roll(speed: float, force: float, step: float) -> tuple[float, float]:
    """Return way and speed after a step of braking, standstill within it."""
    until = min(step, speed / force) if force > 0.0 else step
    return speed * until - force * until * until / 2.0, max(0.0, speed - force * step)


Scene = CutIn | CutOut | Braking
Variant = frozenset[str]


def outcome(
    scene: Scene, model: str, step: float, shift: int = 0, variant: Variant = NO_VARIANT
) -> Outcome:
    """Return what comes of a scene; the driver's delay is ``shift`` steps too long."""
    lane = scene.lane if isinstance(scene, CutIn) else LANE
    driver = DRIVERS[model](shift, step, variant, lane)
    if isinstance(scene, CutIn):
        return cut_in(scene, driver, step)
    if isinstance(scene, CutOut):
        return cut_out(scene, driver, step)
    return braking_lead(scene, driver, step)


def neighbours(
    scene: Scene, model: str, step: float, variant: Variant = NO_VARIANT
) -> list[Outcome]:
    """Return what comes of a scene a step beside it: of the delay, or of the way to the other."""
    if isinstance(scene, CutIn):
        gap, way = scene.gap, (scene.ego - scene.other) * step
    else:
        own = DRIVERS[model](0, step, variant).follows_at(scene.ego)
        gap, way = own if scene.gap is None else scene.gap, scene.ego * step
    nearer, further = (scene._replace(gap=max(gap + side * way, 0.0)) for side in (-1, 1))
    return [
        outcome(scene, model, step, -1, variant),
        outcome(scene, model, step, 1, variant),
        outcome(nearer, model, step, 0, variant),
        outcome(further, model, step, 0, variant),
    ]


def outcomes(task: tuple[list[Scene], str, float], variant: Variant = NO_VARIANT) -> list[Outcome]:
    """Return what comes of many scenes."""
    scenes, model, step = task
    return [outcome(scene, model, step, 0, variant) for scene in scenes]
