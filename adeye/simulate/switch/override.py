"""The authority override of a fork: who acts from a tick on, around what the switch decides."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.ports import SwitchContext
from adeye.signals import NO_CHANNEL, REASON_OVERRIDE, Authority, Bools, Floats, Ints
from adeye.simulate.switch import make_switch
from adeye.spec.quantity import SI
from adeye.spec.switch import Switch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.ports import SwitchModel
    from adeye.signals import ControlCommand, SwitchFaults
    from adeye.sweep.case import TestCase

_NEVER = np.iinfo(np.int64).max


def overriding(
    switch: SwitchModel, cases: Sequence[TestCase], context: SwitchContext
) -> SwitchModel:
    """Put the overrides of some test cases around their switch.

    Args:
        switch: Decides for all runs.
        cases: B test cases of one structure.
        context: What the switch was built with.

    Returns:
        The same switch if no test case has an override.
    """
    if all(case.override is None for case in cases):
        return switch
    return OverriddenSwitch(switch, cases, context)


class OverriddenSwitch:
    """A switch whose decision is replaced in some runs from a tick on.

    Before that tick, and where the switch gives authority to the same channel, its decision stands
    with command and reason: a fork with the original decisions is the original, bit for bit. The
    channel acts under the conditions of every switch: one that is silent, in fault, not finite or
    stale cannot, and then the ego coasts, with no acceleration and the steering last commanded.
    """

    def __init__(
        self, switch: SwitchModel, cases: Sequence[TestCase], context: SwitchContext
    ) -> None:
        """Prepare the overrides, see ``overriding``."""
        self._switch = switch
        overrides = [case.override for case in cases]
        self._from: Ints = np.array(
            [_NEVER if item is None else item.from_tick for item in overrides], dtype=np.int64
        )
        # A switch that knows one channel tells whether it can act, and gives its command if so.
        alone = [
            _only(spec, spec.default if item is None else item.channel)
            for spec, item in zip(context.specs, overrides, strict=True)
        ]
        self._forced = make_switch(SwitchContext(alone, context.channels, context.step))
        self._channel: Ints = np.array(
            [context.channels.index(spec.default) for spec in alone], dtype=np.int64
        )
        self._held = np.zeros(len(overrides))
        self._tick = 0

    def arbitrate(
        self,
        time: float,
        proposals: Sequence[ControlCommand],
        faults: SwitchFaults | None = None,
    ) -> tuple[Floats, Authority]:
        """Return the acting command (B, 2) and who has authority, why.

        Args:
            time: Of this tick [s].
            proposals: Newest command of every channel, in the architecture's order.
            faults: What is wrong with the switch; an override is obeyed all the same.
        """
        command, authority = self._switch.arbitrate(time, proposals, faults)
        forced, own = self._forced.arbitrate(time, proposals)
        can_act = own.channel != NO_CHANNEL
        channel = np.where(can_act, self._channel, NO_CHANNEL)
        agrees = (authority.channel == self._channel) | (authority.channel == channel)
        is_changed: Bools = (self._from <= self._tick) & ~agrees
        coasting = np.stack([np.zeros_like(self._held), self._held], axis=1)
        other = np.where(can_act[:, np.newaxis], forced, coasting)
        command = np.where(is_changed[:, np.newaxis], other, command)
        self._held = command[:, 1].copy()
        self._tick += 1
        return command, Authority(
            np.where(is_changed, channel, authority.channel),
            np.where(is_changed, REASON_OVERRIDE, authority.reason),
        )


def _only(spec: Switch, channel: str) -> Switch:
    """Make the switch that knows one channel, which is stale as it is for the real one."""
    content = {
        "policy": "fixed_priority",
        "priority": (channel,),
        "default": channel,
        "staleness": spec.staleness,
    }
    return Switch.model_validate(content, context=SI)
