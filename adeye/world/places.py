"""Where everything starts: sizes, lanes, and gaps between bumpers resolved to places on the road."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from adeye.errors import SpecError
from adeye.signals import Floats, RoadMap
from adeye.spec.expression import Expression
from adeye.spec.scenario import LogicalScenario
from adeye.world.formulas import Formulas, Pick
from adeye.world.objects import DEFAULT_SIZES
from adeye.world.script import check_lanes

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
        ego_s: (B,) [m].
        ego_d: (B,) [m].
        ego_speed: (B,) [m/s].
    """

    s: Floats
    d: Floats
    heading: Floats
    speed: Floats
    sizes: Floats
    ego_s: Floats
    ego_d: Floats
    ego_speed: Floats


def resolve_starts(formulas: Formulas, road: RoadMap, ego_length: Floats) -> Starts:
    """Evaluate where everything starts.

    ``ahead_of`` with a positive gap puts an actor ahead, with a negative one behind; the gap is
    from bumper to bumper.

    Args:
        formulas: Scenarios of the batch with their parameters.
        road: The road of each run.
        ego_length: (B,) [m].

    Raises:
        SpecError: A lane does not exist, a size is not positive, or ``ahead_of`` runs in a circle.
    """
    scenario = formulas.scenario
    actors, statics = list(scenario.actors), list(scenario.world.objects)
    shape = (formulas.runs, len(actors) + len(statics))
    starts = Starts(
        *(np.zeros(shape) for _ in range(4)),
        sizes=np.zeros((*shape, 3)),
        ego_s=formulas.values("ego.s", lambda s: s.ego.s),
        ego_d=_lateral(formulas, road, "ego", lambda s: s.ego.lane, lambda s: s.ego.offset),
        ego_speed=formulas.limited(
            "ego.speed", lambda s: s.ego.speed, above=-1e-12, unit="m/s"
        ),
    )
    for column, name in enumerate(actors):
        _fill_actor(starts, column, name, formulas, road)
    for column, name in enumerate(statics, start=len(actors)):
        _fill_static(starts, column, name, formulas)
    places = {name: starts.s[:, column] for column, name in enumerate([*actors, *statics])}
    lengths = {name: starts.sizes[:, column, 0] for column, name in enumerate([*actors, *statics])}
    places[EGO], lengths[EGO] = starts.ego_s, ego_length
    for name in gap_order(scenario):
        base = scenario.actors[name].start.ahead_of
        assert base is not None
        gap = formulas.values(
            f"actors.{name}.start.gap", lambda s, name=name: s.actors[name].start.gap
        )
        half = 0.5 * (lengths[name] + lengths[base])
        places[name][:] = places[base] + gap + np.where(gap < 0.0, -half, half)
    return starts


def gap_order(scenario: LogicalScenario) -> list[str]:
    """Order the actors that start relative to others so that each comes after its base.

    Raises:
        SpecError: ``ahead_of`` names nothing of the scenario, or runs in a circle.
    """
    bases = {name: actor.start.ahead_of for name, actor in scenario.actors.items()}
    known = [EGO, *scenario.actors, *scenario.world.objects]
    order: list[str] = []
    for first in scenario.actors:
        chain: list[str] = []
        name: str = first
        while name not in order:
            base = bases.get(name)
            if base is None:
                break
            if base not in known:
                raise SpecError(
                    f"actors.{name}.start.ahead_of: there is no {base!r}",
                    remedy=f"Name one of {', '.join(known)}.",
                )
            chain.append(name)
            if base in chain:
                circle = " → ".join([*chain[chain.index(base) :], base])
                raise SpecError(
                    f"actors.{base}.start.ahead_of: the starts form a circle: {circle}",
                    remedy="Give one of them an s.",
                )
            name = base
        order += reversed(chain)
    return order


def _lateral(formulas: Formulas, road: RoadMap, where: str, lane: Pick, offset: Pick) -> Floats:
    beside = formulas.values(f"{where}.offset", offset, 0.0)
    if lane(formulas.scenario) is None:
        return beside
    number = formulas.values(f"{where}.lane", lane)
    check_lanes(f"{where}.lane", number, road.lanes)
    return (number + 0.5) * road.lane_width + beside


def _fill_actor(starts: Starts, column: int, name: str, formulas: Formulas, road: RoadMap) -> None:
    where = f"actors.{name}"

    def start(what: str) -> Pick:
        return lambda scenario: _formula(scenario.actors[name].start, what)

    lateral = _lateral(formulas, road, f"{where}.start", start("lane"), start("offset"))
    starts.d[:, column] = lateral
    starts.s[:, column] = formulas.values(f"{where}.start.s", start("s"), 0.0)
    starts.heading[:, column] = formulas.values(f"{where}.start.heading", start("heading"), 0.0)
    starts.speed[:, column] = formulas.limited(
        f"{where}.start.speed", start("speed"), above=-1e-12, unit="m/s"
    )
    defaults = DEFAULT_SIZES[formulas.scenario.actors[name].kind]
    for axis, (what, default) in enumerate(
        zip(("length", "width", "height"), defaults, strict=True)
    ):
        starts.sizes[:, column, axis] = formulas.limited(
            f"{where}.size.{what}", _size(name, what), above=0.0, default=default
        )


def _size(name: str, what: str) -> Pick:
    def pick(scenario: LogicalScenario) -> Expression | None:
        size = scenario.actors[name].size
        return None if size is None else _formula(size, what)

    return pick


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
    for axis, what in enumerate(("length", "width", "height")):
        starts.sizes[:, column, axis] = formulas.limited(
            f"{where}.{what}", _static(name, what), above=0.0
        )
