"""Where everything starts: sizes, lanes, and bumper-to-bumper gaps resolved to places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from adeye.errors import SpecError, suggest
from adeye.kernel.manoeuvre import advance
from adeye.kernel.refuges import mark_on_road
from adeye.signals import ROAD_EDGE
from adeye.world.formulas import BELOW_ZERO, Formulas, Pick
from adeye.world.objects import DEFAULT_REFLECTIVITY, DEFAULT_SIZES
from adeye.world.script import WALKER, check_lanes

if TYPE_CHECKING:
    from adeye.signals import Floats, RoadMap
    from adeye.spec.expression import Expression
    from adeye.spec.scenario import LogicalScenario

EGO = "ego"


@dataclass(frozen=True, slots=True)
class Starts:
    """Initial places on the road, in the order of the objects (actors, then static objects).

    Attributes:
        s: (B, M) centre along the road [m].
        d: (B, M) centre from the right edge to the left [m].
        heading: (B, M) relative to the road [rad].
        speed: (B, M) [m/s].
        sizes: (B, M, 3) length, width, height [m].
        reflectivity: (B, M) share of light that the surface returns, for lidar.
        ego_s: (B,) [m].
        ego_d: (B,) [m].
        ego_speed: (B,) [m/s].
    """

    s: Floats
    d: Floats
    heading: Floats
    speed: Floats
    sizes: Floats
    reflectivity: Floats
    ego_s: Floats
    ego_d: Floats
    ego_speed: Floats


def resolve_starts(formulas: Formulas, road: RoadMap, ego_length: Floats) -> Starts:
    """Evaluate where everything starts.

    ``ahead_of`` with a positive gap puts an actor ahead, with a negative one behind; the gap is
    from bumper to bumper along the lane of the one named, at that one's lateral place.

    Args:
        formulas: Scenarios of the batch with their parameters.
        road: The road of each run.
        ego_length: (B,) [m].

    Raises:
        SpecError: A lane does not exist, a size is not positive, ``ahead_of`` runs in a circle, or
            something starts where there is no road.
    """
    scenario = formulas.scenario
    actors, statics = list(scenario.actors), list(scenario.world.objects)
    shape = (formulas.runs, len(actors) + len(statics))
    starts = Starts(
        s=np.zeros(shape),
        d=np.zeros(shape),
        heading=np.zeros(shape),
        speed=np.zeros(shape),
        reflectivity=np.zeros(shape),
        sizes=np.zeros((*shape, 3)),
        ego_s=formulas.values("ego.s", lambda s: s.ego.s),
        ego_d=_lateral(formulas, road, "ego", lambda s: s.ego.lane, lambda s: s.ego.offset),
        ego_speed=formulas.limited(
            "ego.speed", lambda s: s.ego.speed, above=BELOW_ZERO, unit="m/s"
        ),
    )
    for column, name in enumerate(actors):
        _fill_actor(starts, column, name, formulas, road)
    for column, name in enumerate(statics, start=len(actors)):
        _fill_static(starts, column, name, formulas)
    places = {name: starts.s[:, column] for column, name in enumerate([*actors, *statics])}
    lengths = {name: starts.sizes[:, column, 0] for column, name in enumerate([*actors, *statics])}
    beside = {name: starts.d[:, column] for column, name in enumerate([*actors, *statics])}
    places[EGO], lengths[EGO], beside[EGO] = starts.ego_s, ego_length, starts.ego_d
    for name in gap_order(scenario):
        base = scenario.actors[name].start.ahead_of
        if base not in places:
            raise SpecError(
                f"actors.{name}.start.ahead_of: there is no {base!r}",
                remedy=suggest(str(base), places),
            )
        gap = formulas.values(f"actors.{name}.start.gap", _start(name, "gap"))
        half = 0.5 * (lengths[name] + lengths[base])
        half = np.where(gap < 0.0, -half, half)
        bend = [
            advance(line, s, d, way) - advance(line, s, 0.0, way)
            for line, s, d, way in zip(
                road.segments, places[base], beside[base], gap + half, strict=True
            )
        ]
        # The way along the lane less that along the reference line: nothing on a straight.
        places[name][:] = places[base] + gap + half + bend
    _check_on_road("ego", "s", starts.ego_s, starts.ego_d, road, is_beside=False)
    for column, (name, actor) in enumerate(scenario.actors.items()):
        if not actor.start.off_road:
            _check_on_road(
                f"actors.{name}.start",
                "s" if actor.start.ahead_of is None else "gap",
                starts.s[:, column],
                starts.d[:, column],
                road,
                is_beside=actor.kind == WALKER,
            )
    return starts


def _check_on_road(
    where: str, field: str, s: Floats, d: Floats, road: RoadMap, *, is_beside: bool
) -> None:
    """Refuse a start (B,) that is before, behind or, unless it may be, beside the road."""
    remedy = "Move it, or make the road longer."
    if where != EGO:
        remedy += " Who shall stand where there is no road says start.off_road: true."
    outside = ~road.covers(s)
    if outside.any():
        raise SpecError(
            f"{where}.{field}: {s[outside][0]:g} m is not on the road, which is from 0 m to "
            f"{road.length[outside][0]:g} m",
            remedy=remedy,
        )
    if is_beside:
        return
    at, left = s[:, np.newaxis], road.lanes * road.lane_width
    edges = road.shoulder + ROAD_EDGE, road.verge, left + ROAD_EDGE
    outside = ~mark_on_road(road.refuges, *edges, at, d[:, np.newaxis])[:, 0]
    if outside.any():
        raise SpecError(
            f"{where}.offset: {d[outside][0]:g} m from the right edge of the road is neither on a "
            "lane nor on the ground beside that carries a vehicle",
            remedy=remedy.replace("longer", "wider"),
        )


def gap_order(scenario: LogicalScenario) -> list[str]:
    """Order the actors that start relative to others so that each comes after its base.

    Raises:
        SpecError: The starts form a circle.
    """
    circle = gap_circle(scenario)
    if circle:
        raise SpecError(
            f"actors.{circle[0]}.start.ahead_of: the starts form a circle: {' → '.join(circle)}",
            remedy="Give one of them an s.",
        )
    order: list[str] = []
    for name in scenario.actors:
        order += [link for link in reversed(_chain(scenario, name)) if link not in order]
    return order


def gap_circle(scenario: LogicalScenario) -> tuple[str, ...]:
    """Name the actors of a circle of ``ahead_of``, first and last the same; empty for none."""
    for name in scenario.actors:
        chain = _chain(scenario, name)
        last = scenario.actors[chain[-1]].start.ahead_of if chain else None
        if last in chain:
            return (*chain[chain.index(last) :], last)
    return ()


def _chain(scenario: LogicalScenario, first: str) -> list[str]:
    """Follow ``ahead_of`` from an actor over those that start relative to others, each once."""
    chain: list[str] = []
    name: str | None = first
    while name in scenario.actors and name not in chain:
        base = scenario.actors[name].start.ahead_of
        if base is None:
            break
        chain.append(name)
        name = base
    return chain


def _lateral(formulas: Formulas, road: RoadMap, where: str, lane: Pick, offset: Pick) -> Floats:
    beside = formulas.values(f"{where}.offset", offset, 0.0)
    if lane(formulas.scenario) is None:
        return beside
    number = formulas.values(f"{where}.lane", lane)
    check_lanes(f"{where}.lane", number, road.lanes)
    return (number + 0.5) * road.lane_width + beside


def _fill_actor(starts: Starts, column: int, name: str, formulas: Formulas, road: RoadMap) -> None:
    where = f"actors.{name}"
    lateral = _lateral(
        formulas, road, f"{where}.start", _start(name, "lane"), _start(name, "offset")
    )
    starts.d[:, column] = lateral
    starts.s[:, column] = formulas.values(f"{where}.start.s", _start(name, "s"), 0.0)
    starts.heading[:, column] = formulas.values(
        f"{where}.start.heading", _start(name, "heading"), 0.0
    )
    starts.speed[:, column] = formulas.limited(
        f"{where}.start.speed", _start(name, "speed"), above=BELOW_ZERO, unit="m/s"
    )
    kind = formulas.scenario.actors[name].kind
    starts.reflectivity[:, column] = _share(
        formulas,
        f"{where}.reflectivity",
        lambda s: s.actors[name].reflectivity,
        DEFAULT_REFLECTIVITY[kind],
    )
    for axis, what in enumerate(("length", "width", "height")):
        starts.sizes[:, column, axis] = formulas.limited(
            f"{where}.size.{what}", _size(name, what), above=0.0, default=DEFAULT_SIZES[kind][axis]
        )


def _share(formulas: Formulas, what: str, pick: Pick, default: float) -> Floats:
    """Evaluate a formula that must be above 0 and at most 1."""
    column = formulas.limited(what, pick, above=0.0, default=default, unit="")
    if (column > 1.0).any():
        raise SpecError(
            f"{what}: {column.max():g} is above 1",
            remedy="It is a share: above 0, at most 1.",
        )
    return column


def _size(name: str, what: str) -> Pick:
    def pick(scenario: LogicalScenario) -> Expression | None:
        size = scenario.actors[name].size
        return None if size is None else _formula(size, what)

    return pick


def _start(name: str, what: str) -> Pick:
    return lambda scenario: _formula(scenario.actors[name].start, what)


def _static(name: str, what: str) -> Pick:
    return lambda scenario: _formula(scenario.world.objects[name], what)


def _formula(record: object, field: str) -> Expression | None:
    found: Expression | None = getattr(record, field)
    return found


def _fill_static(starts: Starts, column: int, name: str, formulas: Formulas) -> None:
    where = f"world.objects.{name}"
    starts.s[:, column] = formulas.values(f"{where}.s", _static(name, "s"))
    starts.d[:, column] = formulas.values(f"{where}.offset", _static(name, "offset"))
    starts.heading[:, column] = formulas.values(f"{where}.heading", _static(name, "heading"), 0.0)
    starts.reflectivity[:, column] = _share(
        formulas,
        f"{where}.reflectivity",
        _static(name, "reflectivity"),
        DEFAULT_REFLECTIVITY[formulas.scenario.world.objects[name].kind],
    )
    for axis, what in enumerate(("length", "width", "height")):
        starts.sizes[:, column, axis] = formulas.limited(
            f"{where}.{what}", _static(name, what), above=0.0
        )
