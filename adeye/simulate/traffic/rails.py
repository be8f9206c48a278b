"""Reactive traffic on roads told strip by strip: lanes along their lines, and drivers on rails."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from adeye.errors import SpecError
from adeye.kernel.elementary import cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.strips import SLAB_BEGIN
from adeye.kernel.traffic import network, rails
from adeye.kernel.traffic.rails import Rails
from adeye.signals import (
    OBJECT_HEADING,
    OBJECT_SPEED,
    PLACE_COLUMNS,
    PLACE_D,
    PLACE_HEADING,
    PLACE_S,
)
from adeye.simulate.world.roads import RUN_OUT

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats, Ints, Scene
    from adeye.simulate.world.compile import World


class Laid(NamedTuple):
    """The rails of a batch.

    Attributes:
        rails: Lines, lanes and rows of each road (P, ...), vehicles and marks of each run (B, ...).
        road_of: (B,) number of the road of each run; many have the same, which stays in the cache.
        known: (B, A, 6) places of the reactive actors, see ``stage.locate_all``.
    """

    rails: Rails
    road_of: Ints
    known: Floats


def lay_rails(world: World, scene: Scene, vehicles: Floats, marks: Ints) -> Laid:
    """Lay the rails of a batch and put everything on them.

    Args:
        world: What the runs begin with.
        scene: Its first.
        vehicles: (B, 1 + M, network.VEHICLE_WIDTH) the ego, the actors and the static objects.
        marks: (B, 1 + M, network.MARK_WIDTH) theirs.

    Raises:
        SpecError: A reactive actor begins where no lane goes its way, or there are more lanes than
            a vehicle can keep apart.
    """
    context = world.context
    slabs, strips = context.road.slabs, context.road.strips
    runs, pieces, count = *context.road.segments.shape[:2], strips.shape[1]
    across = zip(context.road.segments, context.road.length, slabs, strips, strict=True)
    keys = [b"".join(part.tobytes() for part in parts) for parts in across]
    roads = {key: number for number, key in enumerate(dict.fromkeys(keys))}
    own = Rails(
        np.zeros((len(roads), pieces + 1, rails.LINE_WIDTH)),
        np.zeros((len(roads), count, rails.LANE_WIDTH)),
        np.zeros((len(roads), count, rails.ROW_WIDTH)),
        np.pad(vehicles, ((0, 0), (0, 0), (0, rails.VEHICLE_WIDTH - network.VEHICLE_WIDTH))),
        np.pad(marks, ((0, 0), (0, 0), (0, rails.MARK_WIDTH - network.MARK_WIDTH))),
    )
    own.vehicles[:, 0, rails.HALF_ACROSS] = 0.5 * context.ego_size[:, 1]
    own.vehicles[:, 1:, rails.HALF_ACROSS] = 0.5 * context.object_sizes[..., 1]
    own.marks[..., rails.KEY] = own.marks[..., rails.BY_KEY] = np.arange(marks.shape[1])
    most_lanes = most_rows = 1
    for key, road in roads.items():
        run = keys.index(key)
        rails.lay_line(context.road.segments[run], RUN_OUT, own.line[road])
        # What fills slabs up begins nowhere.
        begun = slabs[run][np.isfinite(slabs[run, :, SLAB_BEGIN])]
        length = float(context.road.length[run])
        rows = own.line[road], own.lanes[road], own.rows[road]
        found = rails.lay_lanes(begun, strips[run], length, *rows)
        if found > rails.MOST_LANES:
            raise SpecError(
                f"world.place: along the road {found} lanes begin, more than {rails.MOST_LANES}",
                remedy="Ask for less of the road with before and after.",
            )
        most_lanes = max(most_lanes, found)
        ends = own.lanes[road, :found, rails.FIRST] + own.lanes[road, :found, rails.COUNT]
        most_rows = max(most_rows, int(ends.max(initial=0.0)))
    # Most strips are no lanes: without their room those of many roads lie closer together.
    own = own._replace(lanes=own.lanes[:, :most_lanes].copy(), rows=own.rows[:, :most_rows].copy())
    known = np.full((runs, len(world.scripted), len(PLACE_COLUMNS)), np.nan)
    laid = Laid(own, np.array([roads[key] for key in keys]), known)
    everyone = np.ones(runs, dtype=np.bool_)
    places = scene.ego_place, scene.object_places
    show_placed(everyone, scene.ego, scene.objects, *places, laid)
    placed = np.ones((runs, marks.shape[1]), dtype=np.bool_)
    begin_drivers(scene.objects, scene.object_places, laid, placed)
    if not placed.all():
        run, who = (int(number) for number in np.argwhere(~placed)[0])
        place = scene.object_places[run, who - 1]
        raise SpecError(
            f"actors.{context.object_ids[who - 1]}.start: at s {place[PLACE_S]:g} m no lane goes "
            "the way that the actor heads",
            remedy="Move it, turn its heading by 180 deg, or leave out reactive.",
        )
    return laid


@inlined
def _rails_of(laid: Laid, run: int) -> Rails:
    """Return the rails of one run."""
    road, own = laid.road_of[run], laid.rails
    return Rails(own.line[road], own.lanes[road], own.rows[road], own.vehicles[run], own.marks[run])


@compiled
def begin_drivers(objects: Floats, places: Floats, laid: Laid, placed: Bools) -> None:
    """Put the reactive actors into their lanes.

    Args:
        objects: (B, M, 5) states.
        places: (B, M, 6).
        laid: In and out, of all runs (B, ...).
        placed: (B, 1 + M) out: false for whom there is no lane.
    """
    for run in range(objects.shape[0]):
        for who in range(1, laid.rails.marks.shape[1]):
            if laid.rails.marks[run, who, network.ROLE] >= network.FOLLOWING:
                place = places[run, who - 1]
                aslant = objects[run, who - 1, OBJECT_HEADING] - place[PLACE_HEADING]
                way = -1.0 if cos(aslant) < 0.0 else 1.0
                placed[run, who] = rails.begin_driver(
                    _rails_of(laid, run), who, place[PLACE_S], place[PLACE_D], way
                )


@compiled
def show_placed(
    running: Bools,
    ego: Floats,
    objects: Floats,
    ego_place: Floats,
    object_places: Floats,
    laid: Laid,
) -> None:
    """Show the ego, the scripted actors and the static objects to the drivers.

    Args:
        running: (B,) runs to do it in.
        ego: (B, 7) states.
        objects: (B, M, 5) states.
        ego_place: (B, 6).
        object_places: (B, M, 6).
        laid: In and out, of all runs (B, ...).
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        for who in range(laid.rails.marks.shape[1]):
            if laid.rails.marks[run, who, network.ROLE] >= network.FOLLOWING:
                continue
            place = ego_place[run] if who == 0 else object_places[run, who - 1]
            # The first columns of both agree.
            state = ego[run] if who == 0 else objects[run, who - 1]
            aslant = state[OBJECT_HEADING] - place[PLACE_HEADING]
            s, d, speed = place[PLACE_S], place[PLACE_D], state[OBJECT_SPEED]
            rails.show_thing(_rails_of(laid, run), who, s, d, aslant, speed)
            if who > 0:
                laid.rails.vehicles[run, who, network.DESIRED_SPEED] = speed


@compiled
def write_reacted(vehicles: Floats, marks: Ints, reacted: Floats) -> None:
    """Write the states (A, 5) of the reactive actors of a run."""
    for actor in range(reacted.shape[0]):
        if marks[1 + actor, network.ROLE] >= network.FOLLOWING:
            vehicle = vehicles[1 + actor]
            row = reacted[actor]
            row[0], row[1], row[2] = (
                vehicle[network.X],
                vehicle[network.Y],
                vehicle[network.HEADING],
            )
            row[3], row[4] = vehicle[network.SPEED], vehicle[network.ACCELERATION]


@compiled
def react_on_rails(running: Bools, laid: Laid, step: float, reacted: Floats) -> None:
    """Advance the reactive actors of all runs by one tick.

    Args:
        running: (B,) runs to do it in.
        laid: In and out, of all runs (B, ...).
        step: [s].
        reacted: (B, A, 5) states of the reactive actors, out.
    """
    for run in range(running.shape[0]):
        if running[run]:
            own = _rails_of(laid, run)
            rails.advance_rails(own, step)
            write_reacted(own.vehicles, own.marks, reacted[run])
            for actor in range(laid.known.shape[1]):
                if own.marks[1 + actor, network.ROLE] >= network.FOLLOWING:
                    rails.write_place(own, 1 + actor, laid.known[run, actor])
