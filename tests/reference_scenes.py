"""A second implementation of the cut-in scene, one at a time, from what the regulation says.

Written without the product: positions along a road instead of gaps, moments instead of counters,
numbers as they stand in the text. Slow, and meant to be read beside the regulation.
"""

from __future__ import annotations

from dataclasses import dataclass

G = 9.81
LENGTH = 4.3
WIDTH = 1.9
LANE = 3.5
END_S = 300.0


@dataclass
class CutIn:
    """Speeds [m/s], gap [m] and speed of the change from one lane's centre to the next [m/s]."""

    ego: float
    other: float
    gap: float
    sideways: float


@dataclass
class Seen:
    """A moment as a driver sees it."""

    time: float
    speed: float
    acceleration: float
    other: float
    distance: float
    beside: float
    sideways: float
    off_centre: float


class Driver:
    """Brakes some time after its decision, ever harder up to a most."""

    delay = 0.75
    ramp = 12.65

    def __init__(self, shift: float, step: float) -> None:
        self.wait = self.delay + shift
        self.step = step
        self.since: float | None = None
        self.waited = 0
        self.force = 0.0
        self.braking = False

    def press(self, most: float) -> float:
        if self.waited * self.step < self.wait - 1e-9:
            self.waited += 1
            self.force = 0.0
        else:
            self.force = min(most, self.force + self.ramp * self.step)
        return self.force

    def force_at(self, seen: Seen) -> float:
        most = self.demand(seen)
        self.braking = most > 0.0
        return self.press(most) if most > 0.0 else 0.0

    def demand(self, seen: Seen) -> float:
        raise NotImplementedError


class Fuzzy(Driver):
    """Annex 4, appendix 3: fuzzy safety model of the 01 series."""

    def demand(self, seen: Seen) -> float:
        if seen.distance < 0.0:
            return 0.0
        if seen.beside > 0.0:
            if seen.sideways <= 0.0 or seen.speed <= seen.other:
                return 0.0
            to_path = seen.beside / seen.sideways
            to_past = (seen.distance + 2 * LENGTH) / (seen.speed - seen.other)
            if not to_path < to_past + 0.1:
                return 0.0
        cfs = self.critical(seen)
        if cfs > 0.0:
            return cfs * (6.0 - 4.0) + 4.0
        return 4.0 * self.proactive(seen)

    @staticmethod
    def proactive(seen: Seen) -> float:
        u, c = seen.speed, seen.other
        d_safe = u * 0.75 + u**2 / 8.0 - c**2 / 14.0 + 2.0
        d_unsafe = u * 0.75 + u**2 / 12.0 - c**2 / 14.0
        x = seen.distance - 2.0
        if x <= d_unsafe:
            return 1.0
        return 0.0 if x >= d_safe else (x - d_safe) / (d_unsafe - d_safe)

    @staticmethod
    def critical(seen: Seen) -> float:
        u, c, d = seen.speed, seen.other, seen.distance
        if u <= c:
            return 0.0
        a = max(seen.acceleration, -4.0)
        u_next = u + 0.75 * a
        if u_next <= c:
            return 1.0 if d < (u - c) ** 2 / abs(2.0 * a) else 0.0
        d_new = ((u + u_next) / 2.0 - c) * 0.75
        d_safe = d_new + (u_next - c) ** 2 / 8.0
        d_unsafe = d_new + (u_next - c) ** 2 / 12.0
        if d <= d_unsafe:
            return 1.0
        return 0.0 if d >= d_safe else (d - d_safe) / (d_unsafe - d_safe)


class Responsible(Driver):
    """Shalev-Shwartz et al. with rho 0.75 s, 3 and 6 m/s^2, sideways 1 m/s^2, 0.3 m."""

    def demand(self, seen: Seen) -> float:
        if seen.distance < 0.0:
            return 0.0
        fast = seen.speed + 0.75 * 3.0
        along = seen.speed * 0.75 + 3.0 * 0.75**2 / 2 + fast**2 / 12.0 - seen.other**2 / 12.0
        towards = seen.sideways + 0.75
        way = (seen.sideways + towards) / 2 * 0.75 + towards**2 / 2.0
        own = 0.75 / 2 * 0.75 + 0.75**2 / 2.0
        across = 0.3 + max(0.0, way + own)
        if seen.distance < max(0.0, along) and seen.beside < across:
            return 0.774 * G
        return 0.0


class Rule(Driver):
    """Paragraph 5.2.5.2: 0.35 s, 6 m/s^2, at 0.3 m beyond the marking, as late as allowed."""

    delay = 0.35
    ramp = float("inf")
    late = 0.0

    def demand(self, seen: Seen) -> float:
        closing = seen.speed - seen.other
        edge = seen.beside + WIDTH / 2
        if closing <= 0.0 or seen.distance < 0.0 or (edge > LANE / 2 - 0.3 and seen.beside > 0.0):
            return 0.0
        if self.braking:
            return 6.0
        left = seen.distance / closing - (closing / 12.0 + 0.35)
        return 6.0 if left <= self.step else 0.0


class Careful(Driver):
    """Annex 4, appendix 3: careful and competent human driver, with emergency braking."""

    def __init__(self, shift: float, step: float) -> None:
        super().__init__(shift, step)
        self.noticed: float | None = None
        self.emergency = 0.0

    def force_at(self, seen: Seen) -> float:
        closing = seen.speed - seen.other
        overlapping = seen.beside <= 0.0
        leaving = seen.off_centre > 0.375 and seen.sideways > 0.0
        critical = closing > 0.0 and seen.distance / closing <= 2.0 and seen.distance >= 0.0
        if not (leaving or overlapping):
            self.noticed = None
            return 0.0
        if self.noticed is None:
            self.noticed = seen.time
        if critical and seen.time - self.noticed >= 0.4 - 1e-9:
            self.braking = True
        force = self.press(0.774 * G) if self.braking else 0.0
        if critical and seen.beside <= -0.95 * WIDTH:
            begun = max(self.emergency, force)
            self.emergency = min(begun + 0.85 * G / 0.6 * self.step, 0.85 * G)
        else:
            self.emergency = 0.0
        return max(force, self.emergency)


DRIVERS = {"cc": Careful, "fsm": Fuzzy, "rss": Responsible, "reg157": Rule}


def contact(scene: CutIn, model: str, step: float, shift: float = 0.0) -> bool | None:
    """Tell whether the model touches the vehicle that cuts in; None: not known after 300 s.

    Args:
        scene: The cut-in.
        model: Name of the driver.
        step: [s].
        shift: What its delay is longer than it should be [s].
    """
    driver = DRIVERS[model](shift, step)
    place, speed, past = 0.0, scene.ego, scene.ego
    start = scene.gap + LENGTH
    tick = 0
    while (time := tick * step) <= END_S:
        across = max(LANE - scene.sideways * time, 0.0)
        other = start + scene.other * time
        distance = other - place - LENGTH
        beside = across - WIDTH
        closing = speed - scene.other
        if distance <= -2 * LENGTH:
            return False
        if beside < 0.0 and distance <= 0.0:
            return True
        moving = scene.sideways if across > 0.0 else 0.0
        acceleration = (speed - past) / step
        force = driver.force_at(
            Seen(time, speed, acceleration, scene.other, distance, beside, moving, LANE - across)
        )
        if speed <= 0.0 or (distance > 0.0 and closing <= 0.0):
            return False
        if driver.braking and distance > 0.0 and beside <= 0.0 and closing < 0.01:
            return False
        past = speed
        until = min(step, speed / force) if force > 0.0 else step
        place += speed * until - force * until * until / 2.0
        speed = max(0.0, speed - force * step)
        tick += 1
    return None


def contacts(task: tuple[list[tuple[float, ...]], str, float]) -> list[bool | None]:
    """Tell it of many scenes: rows of a cut-in, model, step."""
    rows, model, step = task
    return [contact(CutIn(*row), model, step) for row in rows]
