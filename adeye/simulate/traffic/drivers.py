"""Actors that an FMU drives: what is around one goes in, how it drives comes out."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple, NoReturn

import numpy as np

from adeye import signals
from adeye.delivery import insert
from adeye.errors import PluginError, SpecError
from adeye.identity import file_digest
from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import atan, atan2, cos, sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.road import Grounds, ground_of, has_strips, position
from adeye.kernel.storyboard import MOST_DRIFT
from adeye.kernel.strips import middle_of_lane
from adeye.plugins import locate_file
from adeye.signals import Floats, Ints, Scene
from adeye.simulate.bridges.fmus import Fmus, Step, Wired, wire_each, wire_fmu
from adeye.simulate.bridges.programs import INVALID_OUTPUT, Broken
from adeye.simulate.traffic.plant import MOST_FASTER
from adeye.spec.programs import DRIVER_SIGNALS, NEAREST, OBJECT_SIGNALS
from adeye.units import Dimension, shown

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from adeye.simulate.world.compile import World
    from adeye.simulate.world.formulas import Situation
    from adeye.spec.scenario import Driver

COMMAND: Final = {"acceleration": Dimension.ACCELERATION, "lateral_speed": Dimension.SPEED}
"""What the command of a driver is made of."""

NO_LEAD: Final = 1000.0
"""Gap that is told where nobody is ahead in the path [m]."""

MARGIN: Final = 0.2
"""How much nearer than touching its side another one must come to be in the path [m]."""

MOST_SPEED: Final = 150.0
"""Largest speed that an actor is driven at, and largest speed aside that may be said [m/s]: what no
road vehicle reaches. Our choice."""

MOST_ASIDE: Final = 50.0
"""How far from where it began an actor may be driven across the road [m]. Our choice."""

OWN: Final = 1
LEAD: Final = 7
OBJECTS: Final = 10
OBJECT_WIDTH: Final = len(OBJECT_SIGNALS)
"""Where the signals of each part begin, in the order of ``DRIVER_SIGNALS``; the time is first."""


def wire_driver(driver: Driver, base_dir: Path) -> Wired:
    """Read the description of the FMU that drives an actor, and connect its variables.

    Raises:
        InputError: fmpy is not installed.
        SpecError: There is no such FMU, it is another one than planned, or its variables do not
            fit.
    """
    file = locate_file(driver.file, base_dir)
    if file_digest(file) != driver.digest:
        raise SpecError(
            f"{shown(driver.file)} is another file than the scenario was planned with",
            remedy="Plan again, or bring the file back.",
        )
    return wire_fmu(
        driver,
        base_dir,
        [(signal, name, DRIVER_SIGNALS[signal]) for name, signal in sorted(driver.inputs.items())],
        [
            (key, variable, what)
            for key, what in COMMAND.items()
            if (variable := getattr(driver.outputs, key)) is not None
        ],
    )


class Driven(NamedTuple):
    """One actor of one run."""

    run: int
    actor: int


class Drivers:
    """The FMUs that drive actors of a batch, in the runs that have some.

    What they are told is true: everything around them, as far away as it may be.
    """

    def __init__(self, cases: Sequence[Situation], world: World, base_dir: Path) -> None:
        """Prepare; the FMUs are read and started by the first move: worlds are made without, too.

        Args:
            cases: Of one structure.
            world: What they begin with.
            base_dir: Folder of the scenario's file.
        """
        self._world = world
        self._base_dir = base_dir
        self._drivers: list[Driver] = []
        self._driven: list[Driven] = []
        for run, case in enumerate(cases):
            for actor, item in enumerate(case.scenario.actors.values()):
                if item.driver is not None:
                    self._drivers.append(item.driver)
                    self._driven.append(Driven(run, actor))
        things = 1 + world.objects.shape[1]
        self._told: Floats = np.zeros((len(self._drivers), len(DRIVER_SIGNALS)))
        self._columns = {name: column for column, name in enumerate(DRIVER_SIGNALS)}
        self._scratch = np.zeros((things, 2)), np.zeros(things, dtype=np.int64)
        self._wired: list[Wired] = []
        self._began: list[float] = []
        self._fmus: Fmus | None = None

    def move(self, scene: Scene, grounds: Grounds, objects: Floats) -> None:
        """Advance the actors that an FMU drives by one tick.

        Args:
            scene: The present tick.
            grounds: The roads.
            objects: (B, M, 5) states at the next tick, out; rows of others are left alone.

        Raises:
            SpecError: There is no such FMU, or its variables do not fit.
            PluginError: An FMU failed: nobody drives the actor then.
        """
        fmus = self._fmus or self._start(scene)
        step = self._world.context.step
        asked: dict[int, Step] = {}
        for at, (run, _) in enumerate(self._driven):
            if not scene.running[run]:
                fmus.end(at)
                continue
            told = self._tell(at, scene, grounds)
            values = [float(told[self._columns[wire.signal]]) for wire in self._wired[at].inputs]
            asked[at] = Step(values, scene.time, step, is_before=True)
        for at, found in fmus.step(asked).items():
            if isinstance(found, Broken):
                self._fail(at, found, scene.time)
            run, actor = self._driven[at]
            said = dict(zip((w.signal for w in self._wired[at].outputs), found, strict=True))
            command = said["acceleration"], said.get("lateral_speed", 0.0)
            self._require_possible(at, scene, *command)
            _drive(self._around(scene), grounds, (run, actor), command, step, objects)

    def close(self) -> None:
        """End every FMU and wait until they have."""
        if self._fmus is not None:
            self._fmus.close()
            self._fmus = None

    def _start(self, scene: Scene) -> Fmus:
        self._began = [float(scene.object_places[at][signals.PLACE_D]) for at in self._driven]
        self._wired = wire_each(self._drivers, lambda item: wire_driver(item, self._base_dir))
        self._fmus = Fmus(self._drivers, self._wired)
        for at, broken in self._fmus.greet().items():
            self._fail(at, broken, 0.0)
        return self._fmus

    def _tell(self, at: int, scene: Scene, grounds: Grounds) -> Floats:
        """Return what a driver is told (``DRIVER_SIGNALS``), in SI."""
        run, actor = self._driven[at]
        told: Floats = self._told[at]
        told[0] = scene.time
        told[OWN + 5] = self._world.desired_speed[run, actor]
        _look_about(self._around(scene), grounds, (run, actor), *self._scratch, told)
        return told

    def _around(self, scene: Scene) -> Around:
        context = self._world.context
        return Around(
            scene.ego,
            scene.ego_place,
            context.ego_size,
            scene.objects,
            scene.object_places,
            context.object_sizes,
        )

    def _require_possible(self, at: int, scene: Scene, acceleration: float, aside: float) -> None:
        """Refuse a command that no driver gives, and one that has left the road behind."""
        run, actor = self._driven[at]
        speed = scene.objects[run, actor, signals.OBJECT_SPEED]
        away = scene.object_places[run, actor, signals.PLACE_D] - self._began[at]
        found = (
            ("its acceleration is", acceleration, MOST_FASTER, "m/s²"),
            ("its speed aside is", aside, MOST_SPEED, "m/s"),
            ("its speed is", speed, MOST_SPEED, "m/s"),
            ("across the road it is off its start by", away, MOST_ASIDE, "m"),
        )
        for what, value, most, unit in found:
            if not abs(value) <= most:
                said = f"{what} {value:.3g} {unit}, at most {most:g} is taken"
                self._fail(at, Broken(INVALID_OUTPUT, said), scene.time)

    def _fail(self, at: int, broken: Broken, time: float) -> NoReturn:
        name = self._world.context.object_ids[self._driven[at].actor]
        raise PluginError(
            f"actors.{name}.driver {shown(self._drivers[at].file)} failed at {time:g} s: "
            f"{broken.cause}: {broken.detail}. Nobody drives the actor then: mend the FMU"
        )


class Around(NamedTuple):
    """Everything on the roads of a batch: states, places and sizes of egos and objects."""

    ego: Floats
    ego_place: Floats
    ego_size: Floats
    objects: Floats
    places: Floats
    sizes: Floats


@inlined
def _run_of(around: Around, run: int) -> Around:
    """Return everything on the road of one run."""
    return Around(
        around.ego[run],
        around.ego_place[run],
        around.ego_size[run],
        around.objects[run],
        around.places[run],
        around.sizes[run],
    )


@compiled
def _look_about(
    batch: Around,
    grounds: Grounds,
    who: tuple[int, int],
    places: Floats,
    order: Ints,
    told: Floats,
) -> None:
    """Write what an actor's driver is told but for the time and what it wants.

    Args:
        batch: Everything; the ego is the last of those around.
        grounds: The roads.
        who: Run and actor whose driver is told.
        places: (1 + M, 2) scratch: place of each in the frame of the actor.
        order: (1 + M,) scratch.
        told: (``DRIVER_SIGNALS``) out.
    """
    run, actor = who
    around, ground = _run_of(batch, run), ground_of(grounds, run)
    own, place, size = around.objects[actor], around.places[actor], around.sizes[actor]
    along = wrap_to_pi(own[signals.OBJECT_HEADING] - place[signals.PLACE_HEADING])
    way = 1.0 if abs(along) <= 0.5 * math.pi else -1.0
    told[OWN] = own[signals.OBJECT_SPEED]
    told[OWN + 1] = own[signals.OBJECT_ACCELERATION]
    told[OWN + 2] = along if way > 0.0 else wrap_to_pi(along + math.pi)
    offset = place[signals.PLACE_OFFSET]
    if has_strips(ground):
        # Places count from lanes of the ego's way, and this one may go the other way.
        middle = middle_of_lane(
            ground.slabs, ground.strips, place[signals.PLACE_S], place[signals.PLACE_D]
        )
        offset = offset if math.isnan(middle) else place[signals.PLACE_D] - middle
    told[OWN + 3] = way * offset
    told[OWN + 4] = way * place[signals.PLACE_CURVATURE]
    told[LEAD], told[LEAD + 1], told[LEAD + 2] = 0.0, NO_LEAD, own[signals.OBJECT_SPEED]
    s, c = sin_cos(own[signals.OBJECT_HEADING])
    count = 0
    for thing in range(around.objects.shape[0] + 1):
        if thing == actor:
            continue
        is_ego = thing == around.objects.shape[0]
        state = around.ego[:5] if is_ego else around.objects[thing]
        there = around.ego_place if is_ego else around.places[thing]
        body = around.ego_size if is_ego else around.sizes[thing]
        dx, dy = state[0] - own[0], state[1] - own[1]
        places[thing, 0], places[thing, 1] = c * dx + s * dy, -s * dx + c * dy
        insert(order, places, count, thing, dx * dx + dy * dy)
        count += 1
        ahead = way * (there[signals.PLACE_S] - place[signals.PLACE_S])
        aside = abs(there[signals.PLACE_D] - place[signals.PLACE_D])
        gap = ahead - 0.5 * (body[0] + size[0])
        if ahead > 0.0 and aside < 0.5 * (body[1] + size[1]) + MARGIN and gap < told[LEAD + 1]:
            turned = state[2] - there[signals.PLACE_HEADING]
            told[LEAD], told[LEAD + 1] = 1.0, gap
            told[LEAD + 2] = way * state[3] * cos(turned)
    own_vx, own_vy = c * own[signals.OBJECT_SPEED], s * own[signals.OBJECT_SPEED]
    for row in range(NEAREST):
        out = told[OBJECTS + row * OBJECT_WIDTH : OBJECTS + (row + 1) * OBJECT_WIDTH]
        out[:] = 0.0
        if row >= count:
            continue
        thing = order[row]
        is_ego = thing == around.objects.shape[0]
        state = around.ego[:5] if is_ego else around.objects[thing]
        body = around.ego_size if is_ego else around.sizes[thing]
        sine, cosine = sin_cos(state[2])
        vx, vy = state[3] * cosine - own_vx, state[3] * sine - own_vy
        out[0], out[1], out[2] = 1.0, places[thing, 0], places[thing, 1]
        out[3], out[4] = c * vx + s * vy, -s * vx + c * vy
        out[5], out[6] = body[0], body[1]


@compiled
def _drive(
    batch: Around,
    grounds: Grounds,
    who: tuple[int, int],
    command: tuple[float, float],
    step: float,
    objects: Floats,
) -> None:
    """Move an actor along its lane and across it as its driver says.

    Its speed changes evenly over the tick and ends at zero; it does not move aside faster than it
    drives. Where the middle of its lane moves aside, it goes with it.

    Args:
        batch: Everything at the present tick.
        grounds: The roads.
        who: Run and actor.
        command: Acceleration [m/s²], speed across the lane to its own left [m/s].
        step: Length of the tick [s].
        objects: (B, M, 5) states at the next tick, out.
    """
    run, actor = who
    ground, out = ground_of(grounds, run), objects[run, actor]
    state, place = batch.objects[run, actor], batch.places[run, actor]
    acceleration, lateral = command
    s, d = place[signals.PLACE_S], place[signals.PLACE_D]
    along = wrap_to_pi(state[signals.OBJECT_HEADING] - place[signals.PLACE_HEADING])
    way = 1.0 if abs(along) <= 0.5 * math.pi else -1.0
    before = state[signals.OBJECT_SPEED]
    speed = max(0.0, before + acceleration * step)
    # One that stops within the tick stands from there on.
    time = before / -acceleration if acceleration < 0.0 and speed == 0.0 else step
    driven = 0.5 * (before + speed) * time
    mean = driven / step
    lateral = min(max(lateral, -mean), mean)
    forward = math.sqrt(max(0.0, mean * mean - lateral * lateral))
    scale = max(1e-3, 1.0 - place[signals.PLACE_CURVATURE] * d)
    next_s = s + way * forward * step / scale
    next_d = d + way * lateral * step
    turned = atan2(lateral, forward) if mean > 0.0 else 0.0
    if has_strips(ground) and next_s != s:
        drift = middle_of_lane(ground.slabs, ground.strips, next_s, d)
        drift -= middle_of_lane(ground.slabs, ground.strips, s, d)
        if drift != 0.0 and abs(drift) <= MOST_DRIFT * abs(next_s - s):
            next_d += drift
            turned += atan(drift / (next_s - s))
    x, y, heading = position(ground.segments, next_s, next_d)
    out[signals.OBJECT_X], out[signals.OBJECT_Y] = x, y
    facing = heading + turned + (0.0 if way > 0.0 else math.pi)
    out[signals.OBJECT_HEADING] = wrap_to_pi(facing) if mean > 0.0 else state[2]
    out[signals.OBJECT_SPEED] = speed
    out[signals.OBJECT_ACCELERATION] = (speed - before) / step
