"""Which injector a fault has: by the kind of its target and its model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from adeye.faults import actuators, commands, links, timing
from adeye.faults.bodies import BlindSector, Jump, Miscalibration, Pixels, RangeLoss
from adeye.faults.hooks import Hook
from adeye.faults.injectors import DropOut, Silence
from adeye.faults.numbers import NumberFault
from adeye.faults.objects import Ghost, Misclassify, Miss, Split
from adeye.faults.switching import LateSwitch, StuckSwitch

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from adeye.faults.ports import InjectorContext

INJECTORS: Final[Mapping[tuple[str, str], Callable[[InjectorContext], Any]]] = {
    ("sensors", "drop_out"): DropOut,
    ("sensors", "power_loss"): timing.PowerLoss,
    ("sensors", "freeze"): timing.Freeze,
    ("sensors", "stale"): timing.Stale,
    ("sensors", "stale_stamp"): timing.StaleStamp,
    ("sensors", "clock_drift"): timing.ClockDrift,
    ("sensors", "delay"): timing.Delay,
    ("sensors", "sample_loss"): timing.SampleLoss,
    ("sensors", "bias"): NumberFault,
    ("sensors", "scale"): NumberFault,
    ("sensors", "drift"): NumberFault,
    ("sensors", "noise"): NumberFault,
    ("sensors", "quantise"): NumberFault,
    ("sensors", "stuck_at"): NumberFault,
    ("sensors", "spike"): NumberFault,
    ("sensors", "bit_flip"): NumberFault,
    ("sensors", "jump"): Jump,
    ("sensors", "miss"): Miss,
    ("sensors", "ghost"): Ghost,
    ("sensors", "misclassify"): Misclassify,
    ("sensors", "split"): Split,
    ("sensors", "blind_sector"): BlindSector,
    ("sensors", "range_loss"): RangeLoss,
    ("sensors", "miscalibration"): Miscalibration,
    ("sensors", "dead_pixels"): Pixels,
    ("sensors", "pixel_noise"): Pixels,
    ("sensors", "blackout"): Pixels,
    ("channels", "silent"): Silence,
    ("switch", "stuck"): StuckSwitch,
    ("switch", "late"): LateSwitch,
    ("channels", "crash"): Silence,
    ("channels", "slow"): commands.Slow,
    ("channels", "stuck"): commands.Stuck,
    ("channels", "bias"): commands.Bias,
    ("channels", "scale"): commands.Scale,
    ("channels", "oscillating"): commands.Oscillating,
    ("channels", "plausible_but_wrong"): commands.PlausibleButWrong,
    ("channels", "not_a_number"): commands.NotANumber,
    ("channels", "heartbeat_lies"): commands.HeartbeatLies,
    ("links", "drop"): links.Drop,
    ("links", "delay"): links.Delay,
    ("links", "reorder"): links.Reorder,
    ("links", "duplicate"): links.Duplicate,
    ("hooks", "tracks_lost"): Hook,
    ("hooks", "planner_frozen"): Hook,
    ("hooks", "monitors_frozen"): Hook,
    ("hooks", "map_shifted"): Hook,
    ("actuators", "loss"): actuators.Loss,
    ("actuators", "fade"): actuators.Fade,
    ("actuators", "offset"): actuators.Offset,
    ("actuators", "rate_limit"): actuators.RateLimit,
    ("actuators", "delay"): actuators.Delay,
    ("actuators", "stuck"): actuators.Stuck,
    ("tyres", "friction"): actuators.Friction,
}
"""How to make an injector, by kind of target and model."""


def make_injector(context: InjectorContext) -> Any:
    """Make the injector of a fault of a batch."""
    fault = context.specs[0]
    return INJECTORS[fault.port, fault.model](context)
