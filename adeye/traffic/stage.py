"""The ego, the scripted actors and the static objects of a batch in motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.kernel.clock import tick_time
from adeye.kernel.jit import compiled
from adeye.kernel.storyboard import begin_events, end_actions, move_actors
from adeye.signals import Bools, Floats, Ints, Scene
from adeye.traffic.contact import Contacts
from adeye.traffic.ego import Ego
from adeye.traffic.ending import Ending
from adeye.traffic.locate import locate_all

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.world.compile import World
    from adeye.world.formulas import Situation


class Stage:
    """Moves everything but the reactive actors, and keeps what is true at the present tick.

    Attributes:
        world: What the runs began with.
        runs: Number of runs B.
        ego: (B, 7) states.
        objects: (B, M, 5) states.
        ending: Which runs have ended.
    """

    def __init__(self, world: World, cases: Sequence[Situation]) -> None:
        """Set everything to its start, and begin the events whose condition holds at once."""
        context = world.context
        self.world = world
        self.runs = context.runs
        self.ego: Floats = world.ego.copy()
        self.objects: Floats = world.objects.copy()
        self.ending = Ending(
            step=context.step,
            horizon=world.horizon,
            tail=world.tail,
            goal=world.goal,
            road_length=context.road.length,
        )
        self._tick = 0
        self._actors: Floats = world.actors.copy()
        self._ego_place: Floats = np.zeros((self.runs, 6))
        self._object_places: Floats = np.zeros((*self.objects.shape[:2], 6))
        self._begun: Floats = np.full((self.runs, len(context.event_ids)), np.nan)
        self._ended: Bools = np.zeros(self._begun.shape, dtype=np.bool_)
        self._due: Ints = np.full(self._begun.shape, -1, dtype=np.int64)
        self._motion = Ego(cases, context)
        self._contacts = Contacts(context)
        self._everyone: Bools = np.ones(self.runs, dtype=np.bool_)
        self._contacts.update(self._everyone, self.ego, self.objects, self.ego, self.objects)
        self._settle(self._everyone)

    def advance(self, command: Floats, reacted: Floats, friction: Floats | None = None) -> None:
        """Move everything from this tick to the next; runs that have ended stay as they are.

        Args:
            command: (B, 2) acting acceleration [m/s²] and steering angle [rad].
            reacted: (B, A, 5) states at the next tick of the reactive actors; others are not read.
            friction: (B,) of the ego's tyres; None for that of the road.
        """
        running = self.ending.running
        # Scenes keep the arrays of their tick; what changes is written to new ones.
        ego, objects = self.ego, self.objects
        self.ego, self.objects = ego.copy(), objects.copy()
        self._ego_place = self._ego_place.copy()
        self._object_places = self._object_places.copy()
        self._tick += 1
        self._motion.move(running, command, self.ego, friction)
        world = self.world
        move_actors(
            running,
            world.scripted,
            self._actors,
            world.context.road.segments,
            self._tick,
            world.context.step,
            self.objects,
        )
        take_reacted(running, world.scripted, reacted, self.objects)
        self._contacts.update(running, ego, objects, self.ego, self.objects)
        self._settle(running)

    def scene(self) -> Scene:
        """Show what is true at the present tick; later ticks leave it as it is."""
        contacts = self._contacts
        return Scene(
            tick=self._tick,
            time=tick_time(self._tick, self.world.context.step),
            ego=self.ego,
            ego_place=self._ego_place,
            objects=self.objects,
            object_places=self._object_places,
            begun=self._begun,
            ended=self._ended,
            contact=contacts.touched,
            impact_speed=contacts.impact_speed,
            foreign_contact=contacts.foreign,
            running=self.ending.running,
        )

    def _settle(self, running: Bools) -> None:
        """Find everything on the road, end runs and begin events at the present tick."""
        world, script = self.world, self.world.script
        locate_all(
            running,
            self.ego,
            self.objects,
            world.context.road.segments,
            world.context.road.lane_width,
            world.context.road.lanes,
            self._ego_place,
            self._object_places,
        )
        if len(world.context.event_ids):
            self._begun, self._ended = self._begun.copy(), self._ended.copy()
            tick, step = self._tick, world.context.step
            end_actions(running, script.actions, tick, step, self._begun, self._actors, self._ended)
            begin_events(
                running,
                script.ops,
                script.args,
                script.lengths,
                script.programs,
                world.triggers.values(self.scene()),
                world.triggers.first_event,
                script.actions,
                script.order,
                tick,
                tick_time(tick, step),
                self._due,
                self._begun,
                self._ended,
                self._actors,
            )
        self.ending.update(self._tick, self._ego_place[:, 0], self._contacts.touched)


@compiled
def take_reacted(running: Bools, scripted: Bools, reacted: Floats, objects: Floats) -> None:
    """Take the states of the reactive actors from what they have decided.

    Args:
        running: (B,) runs to do it in.
        scripted: (A,) which actors are not reactive.
        reacted: (B, A, 5) states.
        objects: (B, M, 5) out, the actors first.
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        for actor in range(scripted.shape[0]):
            if not scripted[actor]:
                for column in range(reacted.shape[2]):
                    objects[run, actor, column] = reacted[run, actor, column]


class Staged:
    """A traffic that moves its reactive actors itself and leaves everything else to a stage."""

    def __init__(self) -> None:
        """Begin without a stage; ``reset`` of the traffic sets it up."""
        self._stage: Stage | None = None

    @property
    def running(self) -> Bools:
        """Runs that have not ended (B,)."""
        return self._require_stage().ending.running

    @property
    def ended(self) -> Bools:
        """Runs that have ended (B,)."""
        return self._require_stage().ending.ended

    @property
    def arrived(self) -> Bools:
        """Runs whose ego has reached its goal within the horizon (B,)."""
        return self._require_stage().ending.arrived

    @property
    def horizon_row(self) -> Ints:
        """Last row at which an obligation may start (B,)."""
        return self._require_stage().ending.horizon_row

    @property
    def complete(self) -> Bools:
        """Runs that ended by goal or horizon, not by contact or the end of the road (B,)."""
        return self._require_stage().ending.complete

    def _require_stage(self) -> Stage:
        if self._stage is None:
            msg = "reset the traffic before it is used"
            raise RuntimeError(msg)
        return self._stage
