"""A second implementation of the reference drivers, from what the regulation says.

Written without the product, with the numbers as they stand in the text. Meant to be read beside the
regulation. A driver that is given the name of a variant does what the published code does there.
"""

from typing import NamedTuple

G = 9.81
LENGTH = 4.3
WIDTH = 1.9
LANE = 3.5
NO_VARIANT: frozenset[str] = frozenset()
TINY = 1e-9
"""Sums of steps and differences of speeds miss a round number by their rounding."""


class Seen(NamedTuple):
    """A moment as a driver sees it."""

    time: float
    """[s]."""
    speed: float
    """Its own [m/s]."""
    acceleration: float
    """Its own over the last step [m/s^2]."""
    other: float
    """Speed of the other [m/s]."""
    slowing: float
    """How hard the other braked over the last step [m/s^2]."""
    distance: float
    """From front to rear [m]."""
    beside: float
    """From side to side [m], negative where they overlap."""
    sideways: float
    """Speed of the other towards the ego's path [m/s]."""
    off_centre: float
    """How far the vehicle that changes lane is off its lane's centre [m]."""


class Driver:
    """Brakes some time after its decision, ever harder up to a most."""

    delay = 0.75
    ramp = 12.65
    coasting = 0.0

    def __init__(
        self, shift: int, step: float, variant: frozenset[str] = NO_VARIANT, lane: float = LANE
    ) -> None:
        self.variant = variant
        self.lane = lane
        self.cuts_in = False
        # How far back the other may be: rear to front, or centre to centre.
        self.back = -LENGTH if "jrc-beside" in variant else 0.0
        self.prepare()
        whole = 0
        while whole * step < self.delay - TINY:
            whole += 1
        self.waits = whole + shift
        self.step = step
        self.rise = self.ramp * step
        self.pressed = 0.0
        self.braking = False

    def prepare(self) -> None:
        """Take over what variants change in the numbers."""

    def notice(self, seen: Seen) -> None:
        """See whether the other cuts in."""
        if seen.beside > 0.0:
            self.cuts_in = True
        elif seen.speed <= seen.other:
            self.cuts_in = False

    def is_bothered(self, seen: Seen, *, already: bool) -> bool:
        """Tell whether published code brakes to standstill for a lead."""
        if "jrc-lead" not in self.variant or self.cuts_in:
            return False
        if seen.beside > 0.0 or seen.distance < self.back:
            return False
        return already or seen.slowing > TINY or seen.speed - seen.other > TINY

    def press(self, most: float) -> float:
        if self.waits > 0:
            self.waits -= 1
            self.pressed = self.coasting
        else:
            force = self.pressed + self.rise
            self.pressed = force if force < most else most
        return self.pressed

    def follows_at(self, speed: float) -> float:
        """Return the gap that it keeps itself [m]."""
        raise NotImplementedError

    def force(self, seen: Seen) -> float:
        """Return how hard it brakes [m/s^2]."""
        raise NotImplementedError


class Fuzzy(Driver):
    """Annex 4, appendix 3: fuzzy safety model of the 01 series."""

    def follows_at(self, speed: float) -> float:
        return 2.0 + 2.0 + 0.75 * speed + speed**2 / 8.0 - speed**2 / 14.0

    def force(self, seen: Seen) -> float:
        _, speed, acceleration, other, _, distance, beside, sideways, _ = seen
        self.braking = False
        if distance < self.back:
            return 0.0
        if beside > 0.0:
            if sideways <= 0.0 or speed <= other:
                return 0.0
            if not beside / sideways < (distance + 2 * LENGTH) / (speed - other) + 0.1:
                return 0.0
        most = self.demand(speed, acceleration, other, distance)
        if most <= 0.0:
            return 0.0
        self.braking = True
        return self.press(most)

    def demand(self, speed: float, acceleration: float, other: float, distance: float) -> float:
        closing = speed - other
        if closing > 0.0:
            counted = acceleration if acceleration > -4.0 else -4.0
            after = closing + 0.75 * counted
            if after <= 0.0:
                whole = "jrc-raw-acceleration" in self.variant
                if distance < closing * closing / abs(2.0 * (acceleration if whole else counted)):
                    return 6.0
            else:
                way = (closing + after) / 2.0 * 0.75
                safe = way + after * after / 8.0
                if distance < safe:
                    unsafe = way + after * after / 12.0
                    cfs = 1.0 if distance <= unsafe else (distance - safe) / (unsafe - safe)
                    return cfs * (6.0 - 4.0) + 4.0
        unbraked = 0.75 * speed - other * other / 14.0
        safe = unbraked + speed * speed / 8.0 + 2.0
        x = distance - 2.0
        if x >= safe - TINY:
            return 0.0
        unsafe = unbraked + speed * speed / 12.0
        return 4.0 if x <= unsafe else 4.0 * (x - safe) / (unsafe - safe)


class Responsible(Driver):
    """Shalev-Shwartz et al. with rho 0.75 s, 3 and 6 m/s^2, sideways 1 m/s^2, 0.3 m."""

    # The ego's own way to the side while it responds and ends its movement.
    own_side = 0.75**2 / 2 + 0.75**2 / 2.0

    @staticmethod
    def along(speed: float, other: float) -> float:
        fast = speed + 0.75 * 3.0
        return 0.75 * speed + 3.0 * 0.75**2 / 2 + fast * fast / 12.0 - other * other / 12.0

    def follows_at(self, speed: float) -> float:
        if "jrc-distance" in self.variant:
            # The lead has braked by 6 m/s^2 for 0.75 s.
            slower = speed - 0.75 * 6.0
            return self.along(speed, slower if slower > 0.0 else 0.0) + 6.0 * 0.75**2 / 2
        return self.along(speed, speed)

    def force(self, seen: Seen) -> float:
        _, speed, _, other, _, distance, beside, sideways, _ = seen
        self.braking = False
        if distance < self.back or distance >= self.along(speed, other) - TINY:
            return 0.0
        own_side = self.own_side
        if "jrc-rss-lateral" in self.variant:
            sideways, own_side = abs(sideways), 0.0
        towards = sideways + 0.75
        # Who still moves away after its response has no way of braking.
        slowed = towards * towards / 2.0 if towards > 0.0 else 0.0
        way = 0.3 + (sideways + towards) / 2 * 0.75 + slowed + own_side
        if beside >= (way if way > 0.0 else 0.0):
            return 0.0
        self.braking = True
        return self.press(0.774 * G)


class Rule(Driver):
    """Paragraph 5.2.5.2: 0.35 s, 6 m/s^2, at 0.3 m beyond the marking, as late as allowed."""

    ramp = float("inf")

    def prepare(self) -> None:
        self.reserve = 0.25 if "eu-2022-1426" in self.variant else 0.35
        self.delay = 0.0 if "esmini-reaction" in self.variant else self.reserve

    def follows_at(self, speed: float) -> float:
        """Return it after paragraph 5.2.3.3: 1 s at 7.2 km/h, 1.1 s at 10, then 0.1 s per 10."""
        if "jrc-distance" in self.variant:
            return 2.0 * speed
        kmh = speed * 3.6
        if kmh < 10.0:
            gap = 1.0 + 0.1 * max(kmh - 7.2, 0.0) / (10.0 - 7.2)
        else:
            gap = 1.0 + 0.01 * min(kmh, 60.0)
        return max(2.0, speed * gap)

    def force(self, seen: Seen) -> float:
        _, speed, _, other, slowing, distance, beside, _, _ = seen
        before, self.braking = self.braking, False
        self.notice(seen)
        if distance < self.back:
            return 0.0
        # As late as allowed, or 0.1 s earlier than that.
        early = 0.1 if "jrc-guard" in self.variant else self.step
        closing = speed - other
        if closing > 0.0 and self.is_in(beside):
            time = distance / closing if distance > 0.0 else 0.0
            left = time - (closing / 12.0 + self.reserve)
            self.braking = left <= early or (before and "jrc-release" not in self.variant)
        if slowing > 0.0 and beside <= 0.0 and not self.braking:
            self.braking = self.cannot_wait(speed, other, slowing, distance, self.delay + early)
        self.braking = self.braking or self.is_bothered(seen, already=before)
        return self.press(6.0) if self.braking else 0.0

    def is_in(self, beside: float) -> bool:
        """Tell whether the other has intruded."""
        if "jrc-lateral" in self.variant:
            return beside <= 0.5
        return beside <= 0.0 or beside + WIDTH / 2 <= self.lane / 2 - 0.3

    def cannot_wait(
        self, speed: float, lead: float, slowing: float, distance: float, wait: float
    ) -> bool:
        """Tell whether 6 m/s^2, begun a step later, would not do behind a lead that brakes on."""
        if slowing >= 5.0 - TINY:
            return True
        stops = lead / slowing
        if stops > wait:
            room = distance + lead * wait - slowing * wait * wait / 2.0 - speed * wait
            lead -= slowing * wait
        else:
            room = distance + lead * lead / (2.0 * slowing) - speed * wait
            lead = 0.0
        if room <= 0.0:
            return True
        closing = speed - lead
        # Equally fast while the lead still rolls: the gap is least then. Else both stop.
        if closing > 0.0 and 2.0 * room / closing * slowing <= lead:
            return closing * closing / (2.0 * room) + slowing >= 6.0
        return speed * speed / (2.0 * (room + lead * lead / (2.0 * slowing))) >= 6.0


class Careful(Driver):
    """Annex 4, appendix 3: careful and competent human driver, with emergency braking."""

    def prepare(self) -> None:
        self.noticed: float | None = None
        self.perceived = False
        self.emergency = 0.0
        self.g = 9.8 if "esmini-gravity" in self.variant else G
        if "esmini-gravity" in self.variant:
            self.ramp = 0.774 * 9.8 / 0.6
        if "jrc-coasting" in self.variant:
            self.coasting = 0.4

    def follows_at(self, speed: float) -> float:
        return 2.0 * speed

    def force(self, seen: Seen) -> float:
        time, speed, _, other, _, distance, beside, _, off_centre = seen
        closing = speed - other
        overlapping = beside <= 0.0
        self.notice(seen)
        leaving = off_centre > 0.375 and "jrc-perception" not in self.variant
        risk = distance >= self.back and self.is_risk(
            seen, overlapping=overlapping, leaving=leaving
        )
        risk = risk or self.is_bothered(seen, already=self.braking)
        if not (leaving or risk or (overlapping and self.cuts_in)):
            self.noticed = None
            # Once the way is made it is made.
            self.perceived = self.perceived and leaving
        elif self.noticed is None:
            self.noticed = time
        evaluated = self.has_evaluated(time, off_centre)
        if risk and evaluated:
            self.braking = True
        elif (closing <= 0.0 < distance) or not (leaving or overlapping):
            self.braking = False
            self.pressed = 0.0
        force = self.press(0.774 * self.g) if self.braking else 0.0
        return max(force, self.brakes_itself(beside, closing, distance))

    def has_evaluated(self, time: float, off_centre: float) -> bool:
        """Tell whether 0.4 s are over, or for a cut-in in esmini 0.72 m."""
        if "jrc-perception" in self.variant:
            return True
        if self.cuts_in and "esmini-perception" in self.variant:
            self.perceived = self.perceived or off_centre > 0.375 + 0.72
            return self.perceived
        return self.noticed is not None and time - self.noticed >= 0.4 - TINY

    def brakes_itself(self, beside: float, closing: float, distance: float) -> float:
        """Return how hard the automatic emergency braking brakes [m/s^2]."""
        near = closing > 0.0 and distance <= 2.0 * closing
        if self.cuts_in and beside <= -0.95 * WIDTH and near:
            begun = max(self.emergency, self.pressed)
            self.emergency = min(begun + 0.85 * self.g / 0.6 * self.step, 0.85 * self.g)
        else:
            self.emergency = 0.0
        return 0.0 if "jrc-no-emergency" in self.variant else self.emergency

    def is_risk(self, seen: Seen, *, overlapping: bool, leaving: bool) -> bool:
        _, speed, _, other, slowing, distance, _, _, _ = seen
        closing = speed - other
        if overlapping and slowing >= 5.0 - TINY:
            return True
        if closing <= 0.0 or not (overlapping or leaving):
            return False
        if self.cuts_in:
            return distance <= 2.0 * closing
        # Published code knows no headway within which a lead begins to matter.
        near = distance <= 2.0 * speed or "jrc-perception" in self.variant
        return overlapping and (leaving or near)


DRIVERS: dict[str, type[Driver]] = {"cc": Careful, "fsm": Fuzzy, "rss": Responsible, "reg157": Rule}
