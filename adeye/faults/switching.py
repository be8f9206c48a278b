"""What a fault does to the switch: it does not move, or it moves late."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from adeye.spec.faults.switch import Late

if TYPE_CHECKING:
    from adeye.faults.ports import InjectorContext, Moment
    from adeye.signals import SwitchFaults


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
