"""R12: every channel commands at every tick, also without authority."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.sweep.case import TestCase
from adeye.trace import Trace

pytestmark = pytest.mark.requirements


def test_channel_without_authority_is_recorded_at_every_tick(
    cut_ins: tuple[list[TestCase], Trace],
) -> None:
    _, trace = cut_ins
    safety = trace.layout.channels.index("safety")
    for run in range(trace.runs):
        rows = int(trace.length[run]) - 1
        shadow = trace["authority"][run, 1:rows] != safety
        assert shadow.any()
        stamps = trace["stamp"][run, 1:rows, safety]
        assert (np.diff(stamps) > 0.0).all()
        assert np.isfinite(trace["acceleration"][run, :rows]).all()
