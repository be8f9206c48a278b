"""Contact between bodies, swept over each tick so that nothing passes through."""

from __future__ import annotations

import math

import numpy as np

from adeye.kernel.boxes import swept_contact, wrap_to_pi
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.signals import (
    OBJECT_HEADING,
    OBJECT_SPEED,
    OBJECT_X,
    OBJECT_Y,
    Bools,
    Floats,
    Ints,
    SceneContext,
)


class Contacts:
    """What has touched what so far.

    Attributes:
        touched: (B,) object that the ego touches, -1 for none.
        impact_speed: (B,) size of the relative velocity at contact [m/s], 0 before.
        foreign: (B,) whether an actor has touched another object.
    """

    def __init__(self, context: SceneContext) -> None:
        """Start without any contact."""
        self._context = context
        self.touched: Ints = np.full(context.runs, -1, dtype=np.int64)
        self.impact_speed: Floats = np.zeros(context.runs)
        self.foreign: Bools = np.zeros(context.runs, dtype=np.bool_)
        self._extents: Floats = np.zeros((3, len(context.object_ids)))

    def update(
        self,
        running: Bools,
        ego_before: Floats,
        objects_before: Floats,
        ego: Floats,
        objects: Floats,
    ) -> None:
        """Look for contact between two ticks; runs that have ended keep what they have.

        What was found before stays as it is in the arrays of before.

        Args:
            running: (B,).
            ego_before: (B, 7) states at the earlier tick.
            objects_before: (B, M, 5) states at the earlier tick.
            ego: (B, 7) states at the later tick.
            objects: (B, M, 5) states at the later tick.
        """
        self.touched = self.touched.copy()
        self.impact_speed = self.impact_speed.copy()
        self.foreign = self.foreign.copy()
        sweep_contacts(
            running,
            ego_before,
            objects_before,
            ego,
            objects,
            self._context.ego_size,
            self._context.object_sizes,
            self._context.actor_count,
            self._extents,
            self.touched,
            self.impact_speed,
            self.foreign,
        )


@compiled
def sweep_contacts(  # noqa: PLR0913, PLR0917 - a kernel over both ticks
    running: Bools,
    ego_before: Floats,
    objects_before: Floats,
    ego: Floats,
    objects: Floats,
    ego_size: Floats,
    sizes: Floats,
    actors: int,
    extents: Floats,
    touched: Ints,
    impact_speed: Floats,
    foreign: Bools,
) -> None:
    """Find the first contact of the ego, and any of the actors, between two ticks.

    Args:
        running: (B,).
        ego_before: (B, 7) states at the earlier tick.
        objects_before: (B, M, 5) states at the earlier tick.
        ego: (B, 7) states at the later tick.
        objects: (B, M, 5) states at the later tick.
        ego_size: (B, 3).
        sizes: (B, M, 3).
        actors: How many of the objects are actors.
        extents: (3, M) scratch: x, y and extent of each object.
        touched: (B,) out.
        impact_speed: (B,) out [m/s].
        foreign: (B,) in and out.
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        first = math.inf
        x, y = ego_before[run, OBJECT_X], ego_before[run, OBJECT_Y]
        extent = _extent(ego_before[run], ego[run], ego_size[run])
        for thing in range(objects.shape[1]):
            extents[0, thing] = objects_before[run, thing, OBJECT_X]
            extents[1, thing] = objects_before[run, thing, OBJECT_Y]
            extents[2, thing] = _extent(
                objects_before[run, thing], objects[run, thing], sizes[run, thing]
            )
            if not _are_near(extents, thing, x, y, extent):
                continue
            share = contact_share(
                ego_before[run],
                ego[run],
                ego_size[run],
                objects_before[run, thing],
                objects[run, thing],
                sizes[run, thing],
            )
            if share < first:
                first = share
                touched[run] = thing
                impact_speed[run] = speed_between(
                    ego_before[run],
                    ego[run],
                    objects_before[run, thing],
                    objects[run, thing],
                    share,
                )
        if not foreign[run]:
            foreign[run] = _do_actors_touch(
                objects_before[run], objects[run], sizes[run], actors, extents
            )


@inlined
def _do_actors_touch(
    before: Floats, after: Floats, sizes: Floats, actors: int, extents: Floats
) -> bool:
    """Tell whether any of the actors of a run touches another object.

    Args:
        before: (M, 5) states at the earlier tick.
        after: (M, 5) states at the later tick.
        sizes: (M, 3).
        actors: How many of the objects are actors.
        extents: (3, M) x, y and extent of each object.
    """
    for one in range(actors):
        x, y, extent = extents[0, one], extents[1, one], extents[2, one]
        # Nobody else is near most of them, which a loop over all without jumps tells soonest.
        near = 0
        for other in range(extents.shape[1]):
            near += 1 if _are_near(extents, other, x, y, extent) else 0
        if near == 1:
            continue
        for other in range(one + 1, extents.shape[1]):
            if _are_near(extents, other, x, y, extent):
                share = contact_share(
                    before[one], after[one], sizes[one], before[other], after[other], sizes[other]
                )
                if share < math.inf:
                    return True
    return False


@inlined
def _extent(start: Floats, end: Floats, size: Floats) -> float:
    """Return how far from where it starts a body comes in the tick, its own size included [m].

    In either axis; amply, by a millimetre, so that rounding does not decide who is near.
    """
    way = abs(end[OBJECT_X] - start[OBJECT_X]) + abs(end[OBJECT_Y] - start[OBJECT_Y])
    return float(0.5 * (size[0] + size[1]) + way + 1e-3)


@inlined
def _are_near(extents: Floats, thing: int, x: float, y: float, extent: float) -> bool:
    """Tell whether an object and a body at (x, y) [m] may touch; also if nobody knows, with NaN."""
    reach = extents[2, thing] + extent
    return not (abs(extents[0, thing] - x) > reach) | (abs(extents[1, thing] - y) > reach)


@compiled
def contact_share(
    start_1: Floats, end_1: Floats, size_1: Floats, start_2: Floats, end_2: Floats, size_2: Floats
) -> float:
    """Share of the tick at which two bodies first touch, inf if they do not.

    Args:
        start_1: State of one body at the earlier tick: an ego's or an object's, whose first
            columns agree.
        end_1: Its state at the later tick.
        size_1: (3,) length, width, height [m].
        start_2: State of the other body at the earlier tick.
        end_2: Its state at the later tick.
        size_2: (3,) [m].
    """
    dx, dy = start_2[OBJECT_X] - start_1[OBJECT_X], start_2[OBJECT_Y] - start_1[OBJECT_Y]
    rate_x = end_2[OBJECT_X] - end_1[OBJECT_X] - dx
    rate_y = end_2[OBJECT_Y] - end_1[OBJECT_Y] - dy
    # Half diagonals are at most half of length and width together.
    reach = 0.5 * (size_1[0] + size_1[1] + size_2[0] + size_2[1])
    reach += abs(rate_x) + abs(rate_y)
    if dx * dx + dy * dy > reach * reach:
        return math.inf
    _, share = swept_contact(
        start_1[OBJECT_X],
        start_1[OBJECT_Y],
        start_1[OBJECT_HEADING],
        end_1[OBJECT_X],
        end_1[OBJECT_Y],
        end_1[OBJECT_HEADING],
        size_1[0],
        size_1[1],
        start_2[OBJECT_X],
        start_2[OBJECT_Y],
        start_2[OBJECT_HEADING],
        end_2[OBJECT_X],
        end_2[OBJECT_Y],
        end_2[OBJECT_HEADING],
        size_2[0],
        size_2[1],
    )
    return share


@compiled
def speed_between(
    start_1: Floats, end_1: Floats, start_2: Floats, end_2: Floats, share: float
) -> float:
    """Size of the relative velocity of two bodies at a share of the tick [m/s].

    Speeds and headings change evenly between the ticks.

    Args:
        start_1: State of one body at the earlier tick: x, y, heading, speed first.
        end_1: Its state at the later tick.
        start_2: State of the other body at the earlier tick.
        end_2: Its state at the later tick.
        share: From 0 to 1.
    """
    u, v = _velocity(start_1, end_1, share)
    other_u, other_v = _velocity(start_2, end_2, share)
    return math.sqrt((u - other_u) * (u - other_u) + (v - other_v) * (v - other_v))


@compiled
def _velocity(start: Floats, end: Floats, share: float) -> tuple[float, float]:
    speed = start[OBJECT_SPEED] + share * (end[OBJECT_SPEED] - start[OBJECT_SPEED])
    turn = wrap_to_pi(end[OBJECT_HEADING] - start[OBJECT_HEADING])
    sine, cosine = sin_cos(start[OBJECT_HEADING] + share * turn)
    return speed * cosine, speed * sine
