"""R10: what a channel commands is what the ego does, and what it sees follows from that."""

from pathlib import Path

import numpy as np
import pytest

from adeye.signals import NO_CHANNEL
from adeye.sweep.case import TestCase
from adeye.trace import Trace
from tests.requirements.loop import driven, scripted

pytestmark = pytest.mark.requirements


@pytest.mark.slow
def test_ego_turns_where_it_is_steered(tmp_path: Path) -> None:
    trace = driven(scripted(tmp_path, {"only": {"steering_angle": 0.01}}))
    side = trace["ego"][0, : round(2.0 / 0.05), 1]
    assert np.all(np.diff(side) >= 0.0)
    assert side[-1] > side[0] + 1.0


def test_loop_is_closed_over_the_sensors(cut_ins: tuple[list[TestCase], Trace]) -> None:
    _, trace = cut_ins
    # The nominal channel brakes for a cutter that it has seen, and not before.
    rows = round(2.9 / 0.05)
    for run in range(trace.runs):
        seen = trace["detected"][run, :rows, :, 0]
        own = [trace.layout.sensors.index(name) for name in ("front_camera", "front_radar")]
        first = int(np.argmax(seen[:, own].any(axis=1)))
        assert seen[first, own].any()
        braking = trace["acceleration"][run, :rows, 0] < -0.5
        assert not braking[:first].any()


def test_acting_command_is_that_of_the_channel_with_authority(
    cut_ins: tuple[list[TestCase], Trace],
) -> None:
    _, trace = cut_ins
    rows = trace.length[0] - 1
    acting = trace["authority"][:, :rows]
    assert set(np.unique(acting[:, 1:]).tolist()) == {0, 1}
    given = np.stack([trace["acceleration"][:, :rows], trace["steering_angle"][:, :rows]], axis=-1)
    has_one = acting != NO_CHANNEL
    chosen = np.take_along_axis(given, np.maximum(acting, 0)[..., None, None], axis=2)[:, :, 0]
    assert np.array_equal(trace["command"][:, :rows][has_one], chosen[has_one])


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
