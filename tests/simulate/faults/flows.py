"""Samples and commands whose numbers are all one, so that a test sees which of them it has."""

import numpy as np

from adeye.delivery import sample_at
from adeye.signals import OK, ControlCommand, Measurement


def sample(
    number: float,
    *,
    runs: int = 2,
    things: int = 2,
    stamp: float | None = None,
    with_estimate: bool = False,
) -> Measurement:
    """Return a fresh sample with as many detections of the first object."""
    made = sample_at(number if stamp is None else stamp, runs, things)
    made.fresh[:] = made.mask[:] = True
    made.detections[:], made.source[:] = number, 0
    if with_estimate:
        made.estimate = np.full((runs, 13), number)
    return made


def command(
    number: float,
    *,
    channel: str = "nominal",
    runs: int = 2,
    stamp: float | None = None,
    status: int = OK,
) -> ControlCommand:
    """Return a command that accelerates by the number and steers against it."""
    time = np.full(runs, number if stamp is None else stamp)
    states = np.full(runs, status, dtype=np.int64)
    return ControlCommand(channel, np.full(runs, number), np.full(runs, -number), time, states)
