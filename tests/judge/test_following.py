"""The series of what is left against objects in the path, row by row."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.following import DST, MDRAC, MTTC, STN, TTR, is_worse_when_larger
from adeye.judge.series import TraceSeries
from adeye.judge.stl.series import SampleStatus


def test_demands_are_worse_when_larger() -> None:
    assert [what for what in range(10) if is_worse_when_larger(what)] == [MDRAC, DST, STN]
    assert not is_worse_when_larger(MTTC)
    assert not is_worse_when_larger(TTR)


def test_series_has_the_closed_form_at_every_row(hand_made: Any) -> None:
    # 20 m/s towards a standing lead, from 44 m on.
    series = TraceSeries(hand_made().object("lead", speed=0.0, s=48.0).trace())
    gap = 44.0 - 20.0 * series.trace.time
    found = series.samples("mttc")
    assert found.values[0] == pytest.approx(gap / 20.0, rel=1e-9)
    assert (found.actor == 0).all()
    brake = gap / 20.0 - 20.0 / (2.0 * 9.0)
    steer = gap / 20.0 - np.sqrt(2.0 * 2.0 / 9.80665)
    assert series.samples("ttr").values[0] == pytest.approx(np.maximum(brake, steer), rel=1e-9)


def test_braking_lead_at_equal_speed_is_a_conflict_of_accelerations_only(hand_made: Any) -> None:
    series = TraceSeries(hand_made().object("lead", acceleration=-5.0).trace())
    # The lead stands after 4 s and 40 m, the ego is there after 80 m: (40 + 40) / 20.
    assert series.samples("mttc").values[0] == pytest.approx(np.full(21, 4.0), rel=1e-9)
    assert (series.samples("ttc").status[0] == SampleStatus.NO_CONFLICT).all()
    assert (series.samples("ttr").status[0] == SampleStatus.NO_CONFLICT).all()


def test_contact_is_zero_and_an_unknown_speed_an_error(hand_made: Any) -> None:
    made = hand_made().touch(7, "lead")
    made.columns["ego"][0, 3, 3] = np.nan
    found = TraceSeries(made.trace()).samples("mttc")
    assert (found.values[0, 7], found.status[0, 7]) == (0.0, SampleStatus.VALUE)
    assert found.status[0, 3] == SampleStatus.ERROR
