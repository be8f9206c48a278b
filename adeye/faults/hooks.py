"""What a fault does inside a channel: it is told to the hook that the channel offers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from adeye.faults.ports import InjectorContext, Moment
    from adeye.ports import HookedChannel
    from adeye.signals import Floats


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
