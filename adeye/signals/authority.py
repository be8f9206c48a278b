"""Who has authority over the ego, the reasons for it, and what can be wrong with the switch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from adeye.signals.flow import Bools, Floats, Ints

REASON_LABELS: Final = (
    "none",
    "default",
    "request",
    "latched",
    "staleness",
    "no_channel",
    "stuck",
    "returned",
    "voted",
    "no_majority",
    "handover",
)
(
    REASON_NONE,
    REASON_DEFAULT,
    REASON_REQUEST,
    REASON_LATCHED,
    REASON_STALENESS,
    REASON_NO_CHANNEL,
    REASON_STUCK,
    REASON_RETURNED,
    REASON_VOTED,
    REASON_NO_MAJORITY,
    REASON_HANDOVER,
) = range(11)

NO_CHANNEL: Final = -1
"""Authority when no channel can act: the ego coasts."""


@dataclass(slots=True)
class Authority:
    """Whose command acts, and why.

    Attributes:
        channel: (B,) index into the architecture's channels, ``NO_CHANNEL`` for none.
        reason: (B,) index into ``REASON_LABELS``.
    """

    channel: Ints
    reason: Ints


@dataclass(frozen=True, slots=True)
class SwitchFaults:
    """What is wrong with the switch itself at one tick.

    Attributes:
        stuck: (B,) it stays at the channel that it lies at, the default at the start.
        delay: (B,) a change of authority that is decided now takes effect so much later [s].
    """

    stuck: Bools
    delay: Floats

    @classmethod
    def none(cls, runs: int) -> SwitchFaults:
        """Return a sound switch."""
        return cls(np.zeros(runs, dtype=np.bool_), np.zeros(runs))
