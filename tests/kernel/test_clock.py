"""The clock of a run."""

from __future__ import annotations

from decimal import Decimal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.kernel.relation import tick_time, tick_times

STEPS = st.one_of(
    st.integers(1, 1000).map(lambda count: count / 1000),
    st.floats(1e-4, 10.0),
)


@given(tick=st.integers(0, 1_000_000), step=STEPS)
def test_the_time_of_a_tick_is_the_float_nearest_to_its_decimal(tick: int, step: float) -> None:
    assert tick_time(tick, step) == float(tick * Decimal(repr(step)))


@given(ticks=st.lists(st.integers(-1, 1_000_000), max_size=20), step=STEPS)
def test_many_ticks_are_each_of_them(ticks: list[int], step: float) -> None:
    assert tick_times(np.array(ticks, dtype=np.int64), step).tolist() == [
        tick_time(tick, step) for tick in ticks
    ]


@pytest.mark.slow
def test_every_tick_of_a_run_is_what_people_write() -> None:
    for milliseconds in range(1, 1001):
        times = tick_times(np.arange(1001), milliseconds / 1000)
        written = [
            float(f"{tick * milliseconds // 1000}.{tick * milliseconds % 1000:03}")
            for tick in range(1001)
        ]
        assert times.tolist() == written


def test_half_a_step_is_at_the_same_times() -> None:
    ticks = np.arange(10_000)
    assert np.array_equal(tick_times(2 * ticks, 0.025), tick_times(ticks, 0.05))
