"""The worst row of a run and its status, for what is left against objects in the path."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS


def measure(made: Any, column: str) -> Any:
    found = METRICS[column].compute(made.trace())
    return float(found.value[0]), found.status[0], float(found.time[0]), found.actor[0]


def test_earliest_of_equals_and_rows_within_the_run_count(hand_made: Any) -> None:
    made = hand_made().object("lead", speed=15.0)
    assert measure(made, "min_mttc_s")[:3] == (pytest.approx(8.0), "value", 0.0)
    made.object("lead", speed=0.0, s=48.0)
    made.length[:] = 11
    assert measure(made, "min_mttc_s")[:3] == (pytest.approx(1.2), "value", pytest.approx(1.0))


def test_worst_of_several_objects_is_named(hand_made: Any) -> None:
    made = hand_made(objects=("lead", "other"))
    made.object("lead", s=60.0, speed=20.0).object("other", s=90.0, speed=0.0)
    assert measure(made, "min_mttc_s")[3] == 1


def test_contact_from_the_start_leaves_the_manoeuvres_undefined(hand_made: Any) -> None:
    made = hand_made().object("lead", s=3.0, speed=0.0).touch(0, "lead")
    assert measure(made, "min_mttc_s")[:2] == (0.0, "value")
    assert measure(made, "min_ttr_s")[1] == "undefined"


def test_one_unknown_row_makes_an_error_of_all(hand_made: Any) -> None:
    made = hand_made().object("lead", speed=0.0, s=48.0)
    made.columns["object_places"][0, 15, 0, 0] = np.inf
    assert measure(made, "min_ttb_s")[1] == "error"
