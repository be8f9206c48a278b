"""Contact between bodies, swept over each tick so that nothing passes through."""

from __future__ import annotations

import math

import numpy as np

from adeye.kernel.elementary import sin_cos
from adeye.kernel.geometry import swept_contact, wrap_to_pi
from adeye.kernel.jit import compiled
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

    def update(
        self,
        running: Bools,
        ego_before: Floats,
        objects_before: Floats,
        ego: Floats,
        objects: Floats,
    ) -> None:
        """Look for contact between two ticks; runs that have ended keep what they have.

        Args:
            running: (B,).
            ego_before: (B, 7) states at the earlier tick.
            objects_before: (B, M, 5) states at the earlier tick.
            ego: (B, 7) states at the later tick.
            objects: (B, M, 5) states at the later tick.
        """
        sweep_contacts(
            running,
            ego_before,
            objects_before,
            ego,
            objects,
            self._context.ego_size,
            self._context.object_sizes,
            self._context.actor_count,
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
        touched: (B,) out.
        impact_speed: (B,) out [m/s].
        foreign: (B,) in and out.
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        first = math.inf
        for thing in range(objects.shape[1]):
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
        for one in range(actors):
            for other in range(one + 1, objects.shape[1]):
                if not foreign[run]:
                    share = contact_share(
                        objects_before[run, one],
                        objects[run, one],
                        sizes[run, one],
                        objects_before[run, other],
                        objects[run, other],
                        sizes[run, other],
                    )
                    foreign[run] = share < math.inf


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
