"""A second implementation of the scenes, one at a time, from what the regulation says.

Written without the product: positions along a road instead of gaps, moments instead of counters.
"""

from typing import NamedTuple

from tests.reference_models import DRIVERS, LANE, LENGTH, NO_VARIANT, WIDTH, Driver, Seen

END_S = 300.0

VARIANTS = frozenset(
    {"jrc-raw-acceleration", "jrc-coasting", "jrc-perception", "jrc-no-emergency", "jrc-beside",
     "jrc-rss-lateral"}
)  # fmt: skip
"""What the published code does otherwise in a cut-in, of the drivers that it has there."""

APART = float("-inf")
"""What a scene without contact gives instead of the speed of the impact, which is negative where
the side of a vehicle is touched while the gap opens."""


class CutIn(NamedTuple):
    """Speeds [m/s], gap [m], speed of the change from one lane's centre to the next [m/s], width of
    the lanes [m], acceleration up to that speed [m/s^2] (None: at once)."""

    ego: float
    other: float
    gap: float
    sideways: float
    lane: float = LANE
    grows: float | None = None


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


def beside_at(scene: CutIn, time: float) -> tuple[float, float]:
    """Return how far beside the other is [m] and how fast it comes [m/s], so long after it is as
    fast as it gets."""
    across, moving = scene.lane - scene.sideways * time, scene.sideways
    if time < 0.0 and scene.grows is not None:
        moving = max(scene.sideways + scene.grows * time, 0.0)
        across = scene.lane + (scene.sideways**2 - moving**2) / (2.0 * scene.grows)
    return (across, moving) if across > 0.0 else (0.0, 0.0)


def cut_in(scene: CutIn, driver: Driver, step: float) -> Outcome:
    """Let a driver meet a vehicle that cuts in."""
    speed, other, gap, sideways, lane, grows = scene
    is_ended = isinstance(driver, DRIVERS["cc"]) and "jrc-ttc-end" in driver.variant
    grown = 0.0 if grows is None else sideways / grows
    start = gap + LENGTH + (speed - other) * grown
    acceleration = 0.0
    tick = 1 if "jrc-first-step" in driver.variant and grows is None else 0
    place = speed * step * tick
    while (time := tick * step) <= END_S:
        across, moving = beside_at(scene, time - grown)
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
        # Beside one who stands, the other can still come nearer.
        if (speed <= 0.0 and moving <= 0.0) or (distance > 0.0 and min(speed, closing) <= 0.0):
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
    first = step if "jrc-first-step" in driver.variant else 0.0
    place = speed * first
    rear = lead * first + (driver.follows_at(speed) if gap is None else gap)
    acceleration = slowing = 0.0
    tick = 0
    while (time := tick * step) <= END_S:
        distance = rear - place
        closing = speed - lead
        if distance <= 0.0:
            return closing if distance > -2 * LENGTH else APART
        seen = Seen(time + first, speed, acceleration, lead, slowing, distance, -WIDTH, 0.0, 0.0)
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
    tick = 1 if "jrc-first-step" in driver.variant else 0
    place = speed * step * tick
    start = driver.follows_at(speed) if gap is None else gap
    standing = start + LENGTH + front
    acceleration = slowing = 0.0
    rear, across = start, 0.0
    revealed = hit = False
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


def published_cut_in(scene: CutIn, model: str) -> bool:
    """Tell whether a driver of the published code touches who cuts in: steps of 0.1 s for 35 s.

    The sideways speed grows by 0.15 m/s in each step; each way is that of the speed after the step,
    but in the growth that of the speed before it.
    """
    step, grown = 0.1, 0
    driver = DRIVERS[model](0, step, VARIANTS, scene.lane)
    rates = []
    while grown * 0.15 < scene.sideways:
        rates.append(grown * 0.15)
        grown += 1
    across = scene.lane + step * sum(rates)
    speed, acceleration = scene.ego, 0.0
    rear = scene.gap + (scene.ego - scene.other) * step * grown
    for tick in range(grown + 350):
        moving = rates[tick] if tick < grown else scene.sideways
        if across <= 0.0:
            moving = 0.0
        beside = abs(across) - WIDTH
        if beside < 0.0 and -2 * LENGTH < rear < 0.0:
            return True
        near = abs(rear) <= 2.0 * abs(speed - scene.other)
        if model == "cc" and beside <= 0.0 and rear >= driver.back and not near:
            return False
        off_centre = scene.lane - across if moving > 0.0 else 0.0
        time = tick * step
        force = driver.force(
            Seen(time, speed, acceleration, scene.other, 0.0, rear, beside, moving, off_centre)
        )
        slower = max(speed - force * step, 0.0)
        acceleration, speed = (slower - speed) / step, slower
        rear += (scene.other - speed) * step
        across -= (moving if tick < grown else scene.sideways * (across > 0.0)) * step
    return False


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
