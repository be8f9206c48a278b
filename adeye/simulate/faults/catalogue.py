"""Which injector a fault has: by the kind of its target and its model."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.simulate.faults import command_faults, sensor_faults
from adeye.simulate.faults.injector import DropOut, Silence
from adeye.spec.fault import Late

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from adeye.ports import HookedChannel
    from adeye.signals import Floats, SwitchFaults
    from adeye.simulate.faults.injector import InjectorContext, Moment

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
