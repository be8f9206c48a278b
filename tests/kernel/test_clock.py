"""The clock of a run."""

from __future__ import annotations

from decimal import Decimal

import numpy as np
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
