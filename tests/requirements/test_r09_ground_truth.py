"""R9: the truth scene is there at every tick, for the channels that are allowed it only."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.sweep.case import TestCase
from adeye.trace import Trace

pytestmark = pytest.mark.requirements


def test_trace_has_every_object_at_every_tick(cut_ins: tuple[list[TestCase], Trace]) -> None:
    _, trace = cut_ins
    for run in range(trace.runs):
        rows = int(trace.length[run])
        assert np.isfinite(trace["objects"][run, :rows]).all()
        assert np.isfinite(trace["ego"][run, :rows]).all()


def test_only_the_safety_channel_is_linked_to_ground_truth(
    cut_ins: tuple[list[TestCase], Trace],
) -> None:
    _, trace = cut_ins
    channels = trace.layout.architecture.channels
    truths = {
        name
        for name, sensor in trace.layout.architecture.sensors.items()
        if sensor.kind == "ground_truth"
    }
    assert truths & set(channels["safety"].links)
    assert not truths & set(channels["nominal"].links)


def test_ground_truth_sees_every_object(cut_ins: tuple[list[TestCase], Trace]) -> None:
    _, trace = cut_ins
    truth = trace.layout.sensors.index("truth")
    assert trace["detected"][:, 2, truth].all()
