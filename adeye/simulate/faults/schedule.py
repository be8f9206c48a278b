"""When each fault of a batch is present, and which injector it has.

A fault is present from a time, or from when a condition first holds. What it then does is the
matter of its injector, which the kind of its target and its model tell.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye.errors import SpecError
from adeye.kernel.jit import compiled
from adeye.kernel.postfix import Programs, is_satisfied
from adeye.kernel.random import owner_id, uniform
from adeye.signals import SwitchFaults
from adeye.simulate.faults import command_faults, sensor_faults
from adeye.simulate.faults.command_faults import part_of
from adeye.simulate.faults.injector import DropOut, InjectorContext, Moment, Silence
from adeye.simulate.faults.sensor_faults import Pixels
from adeye.simulate.world.storyboard import TriggerTable, compile_conditions
from adeye.spec.architecture import ACTUATORS, targets_of
from adeye.spec.fault import Late
from adeye.spec.sensor_faults import SensorFault

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from adeye.ports import HookedChannel
    from adeye.signals import Bools, ControlCommand, Floats, Ints, Measurement, Scene, SceneContext
    from adeye.simulate.channels.links import View
    from adeye.simulate.sensors.rig import Rig
    from adeye.spec.architecture import Architecture
    from adeye.spec.fault import Fault
    from adeye.sweep.case import TestCase

# --- What a fault does inside a channel: it is told to the hook that the channel offers -----------


class Hook:
    """Tells a channel in which runs a fault is inside it, and how large it is.

    A channel hears of it from the first onset on, so one that has no such fault costs nothing.
    """

    def __init__(self, context: InjectorContext) -> None:
        spec: Any = context.specs[0]
        self._model: str = spec.model
        has_size = hasattr(spec, "offset")
        self._size: Floats = context.column("offset") if has_size else np.ones(len(context.specs))
        self._told = np.zeros(len(context.specs), dtype=np.bool_)

    def apply(self, channel: HookedChannel, moment: Moment) -> HookedChannel:
        """Tell the channel what has changed and return it.

        Args:
            channel: Offers the hook of this fault.
            moment: Tells where the fault is present.
        """
        if not np.array_equal(moment.active, self._told):
            self._told = moment.active.copy()
            channel.inject(self._model, moment.active, self._size)
        return channel


# --- What a fault does to the switch: it does not move, or it moves late --------------------------


class StuckSwitch:
    """The switch keeps the channel that it lies at, also where that is not usable.

    It goes on deciding: after the fault it hands over to whom it would have, with its own latency.
    """

    def __init__(self, _context: InjectorContext) -> None: ...

    def apply(self, thing: SwitchFaults, moment: Moment) -> SwitchFaults:
        """Return what is wrong with the switch, with the fault in the active runs (B,).

        Args:
            thing: What other faults do; returned itself if no run is active.
            moment: Tells where the fault is present.
        """
        if not moment.active.any():
            return thing
        return replace(thing, stuck=thing.stuck | moment.active)


class LateSwitch:
    """A change of authority that is decided while the fault is present takes effect later.

    Delays of several such faults add up. One that runs when the fault ends is not cut short.
    """

    def __init__(self, context: InjectorContext) -> None:
        self._delay = np.array(
            [spec.delay if isinstance(spec, Late) else 0.0 for spec in context.specs]
        )

    def apply(self, thing: SwitchFaults, moment: Moment) -> SwitchFaults:
        """Return what is wrong with the switch, with the fault in the active runs (B,).

        Args:
            thing: What other faults do; returned itself if no run is active.
            moment: Tells where the fault is present.
        """
        if not moment.active.any():
            return thing
        return replace(thing, delay=thing.delay + np.where(moment.active, self._delay, 0.0))


# --- Which injector a fault has: by the kind of its target and its model --------------------------

INJECTORS: Final[Mapping[tuple[str, str], Callable[[InjectorContext], Any]]] = {
    ("sensors", "drop_out"): DropOut,
    ("sensors", "power_loss"): sensor_faults.PowerLoss,
    ("sensors", "freeze"): sensor_faults.Freeze,
    ("sensors", "stale"): sensor_faults.Stale,
    ("sensors", "stale_stamp"): sensor_faults.StaleStamp,
    ("sensors", "clock_drift"): sensor_faults.ClockDrift,
    ("sensors", "delay"): sensor_faults.Delay,
    ("sensors", "sample_loss"): sensor_faults.SampleLoss,
    **{("sensors", model): sensor_faults.NumberFault for model in sensor_faults.CHANGES},
    ("sensors", "jump"): sensor_faults.Jump,
    ("sensors", "miss"): sensor_faults.Miss,
    ("sensors", "ghost"): sensor_faults.Ghost,
    ("sensors", "misclassify"): sensor_faults.Misclassify,
    ("sensors", "split"): sensor_faults.Split,
    ("sensors", "blind_sector"): sensor_faults.BlindSector,
    ("sensors", "range_loss"): sensor_faults.RangeLoss,
    ("sensors", "miscalibration"): sensor_faults.Miscalibration,
    ("sensors", "dead_pixels"): sensor_faults.Pixels,
    ("sensors", "pixel_noise"): sensor_faults.Pixels,
    ("sensors", "blackout"): sensor_faults.Pixels,
    ("channels", "silent"): Silence,
    ("switch", "stuck"): StuckSwitch,
    ("switch", "late"): LateSwitch,
    ("channels", "crash"): Silence,
    ("channels", "slow"): command_faults.Slow,
    ("channels", "stuck"): command_faults.StuckCommand,
    ("channels", "bias"): command_faults.Bias,
    ("channels", "scale"): command_faults.Scale,
    ("channels", "oscillating"): command_faults.Oscillating,
    ("channels", "plausible_but_wrong"): command_faults.PlausibleButWrong,
    ("channels", "not_a_number"): command_faults.NotANumber,
    ("channels", "heartbeat_lies"): command_faults.HeartbeatLies,
    ("links", "drop"): command_faults.Drop,
    ("links", "delay"): command_faults.LinkDelay,
    ("links", "reorder"): command_faults.Reorder,
    ("links", "duplicate"): command_faults.Duplicate,
    **{
        ("hooks", model): Hook
        for model in ("tracks_lost", "planner_frozen", "monitors_frozen", "map_shifted")
    },
    ("actuators", "loss"): command_faults.Loss,
    ("actuators", "fade"): command_faults.Fade,
    ("actuators", "offset"): command_faults.Offset,
    ("actuators", "rate_limit"): command_faults.RateLimit,
    ("actuators", "delay"): command_faults.ActuatorDelay,
    ("actuators", "stuck"): command_faults.StuckActuator,
    ("tyres", "friction"): command_faults.Friction,
}
"""How to make an injector, by kind of target and model."""


def make_injector(context: InjectorContext) -> Any:
    """Make the injector of a fault of a batch."""
    fault = context.specs[0]
    return INJECTORS[fault.port, fault.model](context)


# --- When each fault of a batch is present: from a time, or from when a condition first holds -----

TIME_TOLERANCE = 1e-9
"""Slack of comparisons of times [s]: multiples of the step are not exact."""

ONSET_DRAW: Final = 0xFFFFFFFF
"""Index of the draw of an onset: the last one there is, far from what an injector draws."""


class Times(NamedTuple):
    """When the faults of a batch are present.

    Attributes:
        at: (B, F) onset [s], NaN for one by a condition.
        duration: (B, F) [s].
        every: (B, F) time from one onset to the next [s], inf without.
        onsets: (B, F) how many onsets there are.
    """

    at: Floats
    duration: Floats
    every: Floats
    onsets: Floats


class FaultPlan:
    """The faults of a batch of test cases that share a fault entry; times vary per run.

    A fault is present at the ticks from its onset to before onset plus duration. Where no fault is
    active the very same objects go through.

    Attributes:
        ids: F ids, in the order of the test cases' faults.
    """

    def __init__(self, cases: Sequence[TestCase], context: SceneContext) -> None:
        """Prepare the faults of a batch.

        Args:
            cases: Test cases of one structure.
            context: Objects, events and sizes.

        Raises:
            SpecError: The test cases differ in their faults, or a target does not exist.
        """
        first = cases[0]
        self.ids: tuple[str, ...] = tuple(fault.id for fault in first.faults)
        _check(cases, self.ids)
        shape = (len(cases), len(self.ids))
        times = self._times = Times(
            np.full(shape, np.nan), *(np.full(shape, np.inf) for _ in range(3))
        )
        for run, case in enumerate(cases):
            for index, fault in enumerate(case.faults):
                if fault.onset.at is not None:
                    times.at[run, index] = fault.onset.at
                if fault.onset.between is not None:
                    first_at, last_at = fault.onset.between
                    share = uniform(
                        np.uint64(case.stream_seed),
                        np.uint64(owner_id(f"fault/{fault.id}")),
                        0,
                        ONSET_DRAW,
                    )
                    times.at[run, index] = first_at + share * (last_at - first_at)
                if fault.duration is not None:
                    times.duration[run, index] = fault.duration
                if fault.every is not None:
                    times.every[run, index] = fault.every
                if fault.times is not None:
                    times.onsets[run, index] = fault.times
        self._begun = np.full(shape, np.nan)
        self._triggers = TriggerTable.of(cases, context)
        self._numbers: Ints = np.full(shape, -1, dtype=np.int64)
        self._programs = compile_conditions(
            (
                ((run, index), fault.onset.when)
                for run, case in enumerate(cases)
                for index, fault in enumerate(case.faults)
                if fault.onset.when is not None
            ),
            self._triggers.index,
            self._numbers,
        )
        self._triggers.watch(self._programs)
        self._sound_switch = SwitchFaults.none(len(cases))
        self._injectors: dict[str, list[tuple[int, str, Any]]] = {}
        self._bodies: dict[str, list[tuple[int, Pixels]]] = {}
        for index, fault in enumerate(first.faults):
            made = make_injector(
                InjectorContext(
                    [case.faults[index] for case in cases],
                    context,
                    first.step,
                    np.uint64(owner_id(f"fault/{fault.id}")),
                    [case.architecture for case in cases],
                )
            )
            if isinstance(made, Pixels):
                self._bodies.setdefault(fault.target_id, []).append((index, made))
                continue
            of_port = self._injectors.setdefault(fault.port, [])
            of_port.append((index, fault.target_id, made))

    def update(self, scene: Scene) -> Bools:
        """Decide which faults are present at this tick.

        Args:
            scene: Ground truth at the tick.

        Returns:
            (B, F); false in runs that have ended.
        """
        active = np.zeros(self._begun.shape, dtype=np.bool_)
        if not self.ids:
            return active
        has_programs = (self._numbers >= 0).any()
        _update(
            scene.time,
            scene.running,
            self._times,
            self._triggers.values(scene) if has_programs else np.zeros((active.shape[0], 1)),
            self._programs,
            self._numbers,
            self._begun,
            active,
        )
        return active

    def on_bodies(self, rig: Rig, active: Bools, scene: Scene) -> Rig:
        """Tell the sensors what is wrong with their bodies before they sample.

        Args:
            rig: The sensors; returned, and not touched if no fault is of a body.
            active: (B, F) as ``update`` returned it.
            scene: Ground truth at the tick.
        """
        for name, bodies in self._bodies.items():
            patches = [
                injector.patches(self._moment(index, active, scene)) for index, injector in bodies
            ]
            rig.cover(name, [patch for patch in patches if patch is not None])
        return rig

    def on_readings(
        self, readings: Mapping[str, Measurement], active: Bools, scene: Scene
    ) -> dict[str, Measurement]:
        """Apply the faults of sensors to the newest measurements, in the order of the faults.

        Args:
            readings: By sensor id.
            active: (B, F) as ``update`` returned it.
            scene: Ground truth at the tick.
        """
        faulty = dict(readings)
        for index, name, injector in self._injectors.get("sensors", ()):
            faulty[name] = injector.apply(faulty[name], self._moment(index, active, scene))
        return faulty

    def on_commands(
        self, proposals: Sequence[ControlCommand], active: Bools, scene: Scene
    ) -> list[ControlCommand]:
        """Apply the faults of channels to their newest commands, in the order of the faults.

        Args:
            proposals: One command per channel.
            active: (B, F) as ``update`` returned it.
            scene: Ground truth at the tick.
        """
        faulty = list(proposals)
        for index, name, injector in self._injectors.get("channels", ()):
            for place, command in enumerate(faulty):
                if command.channel == name:
                    faulty[place] = injector.apply(command, self._moment(index, active, scene))
        return faulty

    def on_hooks(self, channels: Mapping[str, Any], active: Bools, scene: Scene) -> None:
        """Tell channels of the faults inside them.

        Args:
            channels: By channel id; see ``ports.HookedChannel`` for what one with a fault offers.
            active: (B, F) as ``update`` returned it.
            scene: Ground truth at the tick.

        Raises:
            SpecError: A channel does not offer the hook.
        """
        for index, name, injector in self._injectors.get("hooks", ()):
            injector.apply(channels[name], self._moment(index, active, scene))

    def on_links(self, active: Bools, scene: Scene, channel: str, view: View) -> View:
        """Apply the faults of a channel's links to what it is shown, in the order of the faults.

        Args:
            active: (B, F) as ``update`` returned it.
            scene: Ground truth at the tick.
            channel: Whose view it is; nobody else's changes.
            view: What there is to be shown; returned itself if no link of the channel has a fault.
        """
        for index, name, injector in self._injectors.get("links", ()):
            reader, _, link = name.partition(".")
            if reader == channel:
                moment = self._moment(index, active, scene)
                thing = view.shown(link, len(scene.running))
                # Before the first decision of the switch there is none to be shown.
                if thing is not None:
                    view = view.instead(link, injector.apply(thing, moment))
        return view

    def on_actuators(self, command: Floats, active: Bools, scene: Scene) -> Floats:
        """Apply the faults of drive, brake and steering to the acting command, in their order.

        Args:
            command: (B, 2) as the switch decided; returned itself unless an actuator does
                something else.
            active: (B, F) as ``update`` returned it.
            scene: Ground truth at the tick.
        """
        faults = self._injectors.get("actuators", ())
        if not faults:
            return command
        parts = {name: part_of(name, command) for name in ACTUATORS}
        done = dict(parts)
        for index, name, injector in faults:
            done[name] = injector.apply(done[name], self._moment(index, active, scene))
        if all(done[name] is parts[name] for name in ACTUATORS):
            return command
        faulty = command.copy()
        moved = (done["drive"] != parts["drive"]) | (done["brake"] != parts["brake"])
        faulty[:, 0] = np.where(moved, done["drive"] + done["brake"], command[:, 0])
        faulty[:, 1] = done["steering"]
        return faulty

    def on_tyres(self, friction: Floats, active: Bools, scene: Scene) -> Floats:
        """Apply the faults of the tyres to the friction coefficients, in the order of the faults.

        Args:
            friction: (B,) of the road; returned itself if no fault is there.
            active: (B, F) as ``update`` returned it.
            scene: Ground truth at the tick.
        """
        for index, _, injector in self._injectors.get("tyres", ()):
            friction = injector.apply(friction, self._moment(index, active, scene))
        return friction

    def on_switch(self, active: Bools, scene: Scene) -> SwitchFaults:
        """Tell what is wrong with the switch; the same object at every tick without such a fault.

        Args:
            active: (B, F) as ``update`` returned it.
            scene: Ground truth at the tick.
        """
        faulty = self._sound_switch
        for index, _, injector in self._injectors.get("switch", ()):
            faulty = injector.apply(faulty, self._moment(index, active, scene))
        return faulty

    def _moment(self, index: int, active: Bools, scene: Scene) -> Moment:
        return Moment(
            time=scene.time,
            active=np.ascontiguousarray(active[:, index]),
            age=scene.time - self._begun[:, index],
            ego=scene.ego,
        )


def _check(cases: Sequence[TestCase], ids: tuple[str, ...]) -> None:
    for case in cases:
        if tuple(fault.id for fault in case.faults) != ids:
            raise SpecError(
                f"test cases with different faults cannot run in one batch: {', '.join(ids)} and "
                f"{', '.join(fault.id for fault in case.faults)}",
                remedy="Group them by fault entry.",
            )
    for fault in cases[0].faults:
        _check_target(fault, cases[0].architecture)


def _check_target(fault: Fault, architecture: Architecture) -> None:
    known = targets_of(architecture)
    if fault.target not in known:
        alike = [name for name in known if name.split(".")[0] == fault.port] or known
        raise SpecError(
            f"fault {fault.id}: architecture {architecture.architecture} has no {fault.target}",
            remedy=f"It has {', '.join(alike)}.",
        )
    if isinstance(fault, SensorFault):
        for loc, text in fault.misfits(architecture.sensors[fault.target_id]):
            raise SpecError(f"fault {fault.id}: {'.'.join(map(str, loc))}: {text}")


@compiled
def _update(  # noqa: PLR0913, PLR0917 - a kernel
    time: float,
    running: Bools,
    times: Times,
    variables: Floats,
    programs: Programs,
    numbers: Ints,
    begun: Floats,
    active: Bools,
) -> None:
    for run in range(begun.shape[0]):
        if not running[run]:
            continue
        for fault in range(begun.shape[1]):
            number = numbers[run, fault]
            if np.isnan(begun[run, fault]):
                if number < 0:
                    if time >= times.at[run, fault] - TIME_TOLERANCE:
                        begun[run, fault] = times.at[run, fault]
                elif is_satisfied(programs, number, variables[run]):
                    begun[run, fault] = time
            last = begun[run, fault]
            if times.every[run, fault] < np.inf:
                gone = np.floor((time - last + TIME_TOLERANCE) / times.every[run, fault])
                last += min(gone, times.onsets[run, fault] - 1.0) * times.every[run, fault]
            # NaN compares false, too: what has not begun is not active.
            active[run, fault] = time < last + times.duration[run, fault] - TIME_TOLERANCE
