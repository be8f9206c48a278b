"""Which injector a fault has: by the kind of its target and its model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from adeye.faults.bodies import BlindSector, Jump, Miscalibration, Pixels, RangeLoss
from adeye.faults.injectors import DropOut, Silence
from adeye.faults.numbers import NumberFault
from adeye.faults.objects import Ghost, Misclassify, Miss, Split
from adeye.faults.timing import (
    ClockDrift,
    Delay,
    Freeze,
    PowerLoss,
    SampleLoss,
    Stale,
    StaleStamp,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from adeye.faults.ports import InjectorContext

INJECTORS: Final[Mapping[tuple[str, str], Callable[[InjectorContext], Any]]] = {
    ("sensors", "drop_out"): DropOut,
    ("sensors", "power_loss"): PowerLoss,
    ("sensors", "freeze"): Freeze,
    ("sensors", "stale"): Stale,
    ("sensors", "stale_stamp"): StaleStamp,
    ("sensors", "clock_drift"): ClockDrift,
    ("sensors", "delay"): Delay,
    ("sensors", "sample_loss"): SampleLoss,
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
}
"""How to make an injector, by kind of target and model."""


def make_injector(context: InjectorContext) -> Any:
    """Make the injector of a fault of a batch."""
    fault = context.specs[0]
    return INJECTORS[fault.port, fault.model](context)
