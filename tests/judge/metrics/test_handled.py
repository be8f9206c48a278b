"""Rows at which a fault is present, detected and handled, over hand-made runs."""

from __future__ import annotations

from typing import Any

import numpy as np

from adeye.judge.metrics.handling import decided_rows, default_channel, handled


def test_rows_of_a_run_whose_fault_is_handled(hand_made: Any) -> None:
    made = hand_made(runs=2).ego(1, speed=np.where(np.arange(21) < 15, 8.0, 0.0))
    made.columns["fault_active"][1, 5:, 0] = True
    made.columns["monitors"][1, 7:, 0, 1] = True
    made.columns["authority"][1, 8:] = 1
    made.columns["command"][1, 10:, 0] = -4.0
    found = handled(made.trace())
    assert (found.fault.tolist(), found.detect.tolist()) == ([-1, 5], [-1, 7])
    assert (found.emergency.tolist(), found.safe.tolist()) == ([-1, 10], [-1, 15])
    assert not found.is_unknown.any()
    assert np.isnan(found.intervals.fhti[0])


def test_ego_that_stands_already_is_safe_from_the_fault_on(hand_made: Any) -> None:
    made = hand_made().ego(speed=0.0).set("fault_active", value=True, rows=slice(5, None), at=0)
    assert handled(made.trace()).safe.tolist() == [5]


def test_last_row_of_a_run_decides_nothing(hand_made: Any) -> None:
    trace = hand_made().trace()
    assert decided_rows(trace)[0].tolist() == [True] * 20 + [False]
    assert default_channel(trace) == 0
