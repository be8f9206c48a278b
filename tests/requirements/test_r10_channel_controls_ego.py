"""R10: the ego does what the acting channel commands, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.sweep.case import TestCase
from adeye.trace import Trace

pytestmark = pytest.mark.requirements


def test_acting_command_is_that_of_the_channel_with_authority(
    cut_ins: tuple[list[TestCase], Trace],
) -> None:
    _, trace = cut_ins
    for run in range(trace.runs):
        for row in range(int(trace.length[run]) - 1):
            channel = int(trace["authority"][run, row])
            if channel >= 0:
                assert trace["command"][run, row, 0] == trace["acceleration"][run, row, channel]


def test_ego_follows_the_commanded_acceleration(cut_ins: tuple[list[TestCase], Trace]) -> None:
    cases, trace = cut_ins
    lag = cases[0].architecture.vehicle.acceleration_lag
    step = cases[0].step
    for run in range(trace.runs):
        rows = int(trace.length[run])
        speed = trace["ego"][run, : rows - 1, 3]
        moving = np.flatnonzero(speed[1:] > 1.0)
        before = trace["ego"][run, moving, 4]
        wanted = trace["command"][run, moving, 0]
        expected = wanted + (before - wanted) * np.exp(-step / lag)
        np.testing.assert_allclose(trace["ego"][run, moving + 1, 4], expected, atol=1e-6)
