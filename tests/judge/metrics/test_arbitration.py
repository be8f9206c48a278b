"""Disagreement of the channels, whoever of them acts."""

from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS
from adeye.signals import DEGRADED, FAULT, SILENT
from tests.judge.conftest import measure

BRAKING, STEERING = "max_acceleration_disagreement_mps2", "max_steering_disagreement_rad"


@pytest.mark.parametrize(
    ("column", "name"), [(BRAKING, "acceleration"), (STEERING, "steering_angle")]
)
def test_largest_difference_counts_with_its_time(hand_made: Any, column: str, name: str) -> None:
    made = hand_made().set(name, -0.3, rows=6, at=1).set(name, 0.1, rows=6, at=0)
    made.set(name, 0.2, rows=9, at=1)
    assert measure(made, column) == (pytest.approx(0.4), "value", pytest.approx(0.6), -1)


def test_channels_that_command_alike_agree(hand_made: Any) -> None:
    made = hand_made().set("acceleration", -8.0)
    assert measure(made, BRAKING)[:2] == (0.0, "value")


def test_disagreement_does_not_depend_on_who_acts(hand_made: Any) -> None:
    made = hand_made().set("acceleration", -5.0, rows=4, at=1)
    before = measure(made, BRAKING)
    assert measure(made.set("authority", 1), BRAKING) == before


@pytest.mark.parametrize("status", [FAULT, SILENT])
@pytest.mark.parametrize("channel", [0, 1])
def test_channel_without_a_command_disagrees_with_nobody(
    hand_made: Any, status: int, channel: int
) -> None:
    made = (
        hand_made().set("acceleration", -9.0, rows=4, at=1).set("acceleration", -2.0, rows=8, at=1)
    )
    made.set("status", status, rows=4, at=channel)
    assert measure(made, BRAKING) == (pytest.approx(2.0), "value", pytest.approx(0.8), -1)


def test_degraded_channel_still_commands(hand_made: Any) -> None:
    made = hand_made().set("acceleration", -9.0, rows=4, at=1).set("status", DEGRADED, rows=4, at=1)
    assert measure(made, BRAKING)[0] == pytest.approx(9.0)


def test_command_that_is_no_number_is_none(hand_made: Any) -> None:
    made = hand_made().set("acceleration", np.nan, rows=4, at=1)
    made.set("steering_angle", 0.5, rows=4, at=1).set("steering_angle", 0.1, rows=7, at=1)
    assert measure(made, STEERING) == (pytest.approx(0.1), "value", pytest.approx(0.7), -1)


def test_nothing_to_compare_is_undefined(hand_made: Any) -> None:
    assert measure(hand_made().set("status", SILENT, at=1), BRAKING)[1] == "undefined"


def test_last_row_decides_nothing(hand_made: Any) -> None:
    made = hand_made().set("acceleration", -9.0, rows=20, at=1)
    assert measure(made, BRAKING)[0] == 0.0


def test_single_channel_has_nobody_to_disagree_with(hand_made: Any) -> None:
    made = hand_made()
    for name in ("acceleration", "steering_angle", "status"):
        made.columns[name] = made.columns[name][..., :1]
    assert measure(made, BRAKING)[1] == "not_applicable"


def test_runs_of_a_batch_are_apart(hand_made: Any) -> None:
    made = hand_made(runs=2)
    made.columns["acceleration"][1, 3, 1] = -4.0
    found = METRICS[BRAKING].compute(made.trace())
    assert list(found.value) == [0.0, 4.0]
