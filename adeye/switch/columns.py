"""What the switch remembers of a run, and the policies, by number: shared by its compiled parts."""

from __future__ import annotations

from typing import Final

TIME_TOLERANCE: Final = 1e-9
"""Slack of comparisons of times [s]: multiples of the step are not exact."""

POLICIES: Final = ("fixed_priority", "hysteresis", "voting", "stuck")
FIXED_PRIORITY, HYSTERESIS, VOTING, STUCK = range(4)

START: Final = -2
"""Stands for a channel before the first one has acted."""

# What is remembered in whole numbers.
(
    HOLDER,  # channel that keeps the authority that it took, -1 for none
    HEARD,  # whether the default, or a majority, has been usable
    CONNECTED,  # channel that the switch lies at, START before the first
    PENDING,  # channel that it is being handed over to, -1 for none
    PENDING_REASON,  # why
    SOURCE,  # channel whose command acted last, -1 for nobody, START before the first
    BLENDING,  # whether the acting command is still on its way to that of its channel
) = range(7)
WORDS: Final = 7

# What is remembered in real numbers.
(
    QUIET,  # since when the default is healthy and nobody requests [s], NaN if it is not so
    DUE,  # when the pending handover takes effect [s]
    ACCELERATION,  # acting acceleration of the tick before [m/s²]
    STEERING,  # acting steering angle of the tick before [rad]
) = range(4)
NUMBERS: Final = 4
