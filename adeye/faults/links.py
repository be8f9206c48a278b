"""What a fault does to what one channel is shown of a sensor, of another channel or of the switch.

Nobody else's view changes. What a link carries comes in messages: a sensor's is a sample that is
delivered, or that it does not deliver; channels and the switch send one at each tick.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any, Generic, cast

import numpy as np

from adeye.faults.rows import Past, Queue, Rows, copied, nothing_yet, take_rows
from adeye.kernel.random import uniform
from adeye.signals import Authority, Measurement

if TYPE_CHECKING:
    from adeye.faults.ports import InjectorContext, Moment
    from adeye.signals import Bools, ControlCommand


class Delay(Generic[Rows]):
    """What a link shows comes later, in order.

    From the onset on, what was shown last stands until the first message since then has come
    through; after the end the newest one is shown at once.
    """

    def __init__(self, context: InjectorContext) -> None:
        self._queue: Queue[Rows] = Queue(context.ticks("by"))

    def apply(self, thing: Rows, moment: Moment) -> Rows:
        """Return what the channel is shown, with the fault in the active runs (B,)."""
        late, stands = self._queue.apply(thing, moment.active)
        if late is not thing:
            _not_fresh(late, stands)
        return late


class _Lossy(Generic[Rows]):
    """Some messages are not what they should be, each by its own draw.

    Where the newest message has not come through, what was shown last stands.
    """

    def __init__(self, context: InjectorContext) -> None:
        self._seeds = context.scene.stream_seeds
        self._owner = context.owner
        runs = len(context.specs)
        self._probability = context.column("probability")
        self._number = np.zeros(runs, dtype=np.int64)
        self._behind = np.zeros(runs, dtype=np.bool_)
        self._shown: Any = None

    def _drawn(self, messages: Bools, active: Bools) -> Bools:
        """Tell which messages are hit; every message of the run counts, so that none shifts."""
        hit = np.zeros(messages.shape, dtype=np.bool_)
        for run in np.flatnonzero(messages & active):
            draw = uniform(self._seeds[run], self._owner, int(self._number[run]), 0)
            hit[run] = draw < self._probability[run]
        self._number += messages
        return hit

    def _last(self, thing: Rows) -> Rows:
        if self._shown is None:
            self._shown = nothing_yet(thing)
        last: Rows = self._shown
        return last

    def _show(self, thing: Rows) -> Rows:
        """Remember what is shown; the stages before may use their arrays again."""
        self._shown = copied(thing)
        return thing


class Drop(_Lossy[Rows]):
    """Messages are lost, alone or in bursts."""

    def __init__(self, context: InjectorContext) -> None:
        super().__init__(context)
        self._burst = context.column("burst").astype(np.int64)
        self._left = np.zeros(self._burst.shape, dtype=np.int64)

    def apply(self, thing: Rows, moment: Moment) -> Rows:
        """Return what the channel is shown, with the fault in the active runs (B,)."""
        active, messages, last = moment.active, _messages(thing), self._last(thing)
        begins = self._drawn(messages, active) & (self._left == 0)
        self._left = np.where(begins, self._burst, self._left) * active
        lost = messages & (self._left > 0)
        self._left -= lost
        self._behind = active & np.where(messages, lost, self._behind)
        if not active.any():
            return self._show(thing)
        seen = copied(thing)
        take_rows(seen, last, self._behind)
        _not_fresh(seen, self._behind)
        return self._show(seen)


class Duplicate(_Lossy[Rows]):
    """The message before comes again in place of a new one, with the stamp of the new one."""

    def apply(self, thing: Rows, moment: Moment) -> Rows:
        """Return what the channel is shown, with the fault in the active runs (B,)."""
        active, messages, last = moment.active, _messages(thing), self._last(thing)
        again = self._drawn(messages, active)
        self._behind = active & np.where(messages, again, self._behind)
        if not active.any():
            return self._show(thing)
        seen = copied(thing)
        take_rows(seen, last, self._behind)
        for name, runs in (("stamp", again), ("fresh", self._behind)):
            # The switch's state has neither.
            if hasattr(seen, name):
                getattr(seen, name)[runs] = getattr(thing, name)[runs]
        return self._show(seen)


class Reorder(_Lossy[Rows]):
    """Messages are held up, and shown when they arrive, although newer ones have been.

    What is still held up when the fault ends is lost.
    """

    def __init__(self, context: InjectorContext) -> None:
        super().__init__(context)
        self._lags = context.ticks("by")
        longest = int(self._lags.max(initial=0))
        self._past: Past[Rows] = Past(longest)
        self._held: deque[Bools] = deque(maxlen=longest + 1)

    def apply(self, thing: Rows, moment: Moment) -> Rows:
        """Return what the channel is shown, with the fault in the active runs (B,)."""
        active, messages, last = moment.active, _messages(thing), self._last(thing)
        held = self._drawn(messages, active)
        self._past.add(thing)
        self._held.appendleft(held)
        for earlier in self._held:
            earlier[~active] = False
        arrives = np.zeros(active.shape, dtype=np.bool_)
        for run in np.flatnonzero(active):
            lag = self._lags[run]
            arrives[run] = lag < len(self._held) and self._held[lag][run]
        if not active.any():
            self._behind[:] = False
            return self._show(thing)
        stands = active & ~arrives & np.where(messages, held, self._behind)
        self._behind = active & (stands | arrives)
        seen = copied(thing)
        take_rows(seen, last, stands)
        _not_fresh(seen, stands)
        self._past.write(seen, self._lags, arrives)
        return self._show(seen)


def _messages(thing: object) -> Bools:
    """Tell in which runs (B,) something is sent at this tick."""
    if isinstance(thing, Measurement):
        return thing.fresh | ~thing.alive
    rows = thing.channel if isinstance(thing, Authority) else cast("ControlCommand", thing).stamp
    return np.ones(rows.shape, dtype=np.bool_)


def _not_fresh(thing: object, runs: Bools) -> None:
    if isinstance(thing, Measurement):
        thing.fresh[runs] = False
