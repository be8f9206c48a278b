"""Where the ego stands at the end, and what was reachable, over hand-made runs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS
from adeye.judge.safe_stop import rate_run
from adeye.spec.channels import SafetyChannel, SafetyParameters

SLOW, MIDDLE = 1.75, 5.25
BOTH = ("stop_rating", "stop_regret")


def stopped(make: Any, d: float = SLOW, *, fault: bool = True, **arguments: Any) -> Any:
    """Let the ego stop with 4 m/s² from 20 m/s after 1 s, where the fault begins."""
    made = make(rows=91, **arguments).object("lead", d=8.75)
    braking = np.clip(made.time - 1.0, 0.0, 5.0)
    way = 20.0 * np.minimum(made.time, 1.0) + 20.0 * braking - 2.0 * braking * braking
    made.ego(s=way, speed=20.0 - 4.0 * braking, d=d)
    return made.set("fault_active", value=True, rows=slice(10, 90)) if fault else made


def with_shoulder(made: Any, width: float) -> Any:
    trace = made.trace()
    trace.layout.context.road.shoulder[:] = width
    return trace


def measured(trace: Any, run: int = 0) -> list[tuple[str, float]]:
    found = [METRICS[name].compute(trace) for name in BOTH]
    return [(column.status[run], float(column.value[run])) for column in found]


def statuses(trace: Any) -> list[str]:
    return [status for status, _ in measured(trace)]


def test_stop_in_the_slow_lane_beside_a_free_shoulder_is_regretted(hand_made: Any) -> None:
    assert measured(with_shoulder(stopped(hand_made), 2.5)) == [("value", 3.0), ("value", 2.0)]
    assert measured(with_shoulder(stopped(hand_made), 0.0)) == [("value", 3.0), ("value", 0.0)]


def test_who_drives_on_has_no_place(hand_made: Any) -> None:
    made = hand_made().set("fault_active", value=True, rows=slice(5, 20))
    assert statuses(made.trace()) == ["not_applicable", "not_applicable"]


def test_who_creeps_no_faster_than_standstill_stands(hand_made: Any) -> None:
    made = stopped(hand_made)
    made.columns["ego"][0, 90, 3] = 0.04
    assert statuses(made.trace()) == ["value", "value"]
    made.columns["ego"][0, 90, 3] = 0.06
    assert statuses(made.trace()) == ["not_applicable", "not_applicable"]


def test_without_a_fault_nothing_is_regretted(hand_made: Any) -> None:
    assert statuses(stopped(hand_made, fault=False).trace()) == ["value", "not_applicable"]


def test_contact_is_rated_worst_with_its_time_and_actor(hand_made: Any) -> None:
    trace = with_shoulder(stopped(hand_made).touch(40, "lead"), 2.5)
    assert measured(trace) == [("value", 8.0), ("value", 7.0)]
    for name in BOTH:
        column = METRICS[name].compute(trace)
        assert (column.time[0], column.actor[0]) == (pytest.approx(4.0), 0)


@pytest.mark.parametrize(
    ("column", "row", "expected"),
    [
        ("ego", 90, ["error", "error"]),
        ("ego_place", 90, ["error", "error"]),
        ("ego", 10, ["value", "error"]),
        ("objects", 30, ["value", "error"]),
        ("object_places", 10, ["value", "error"]),
        ("objects", 5, ["value", "value"]),
    ],
)
def test_what_is_not_finite_is_never_a_good_place(
    hand_made: Any, column: str, row: int, expected: list[str]
) -> None:
    made = stopped(hand_made)
    made.columns[column][0, row] = np.nan
    assert statuses(made.trace()) == expected


def test_each_run_is_rated_by_its_own_architecture_and_as_by_itself(hand_made: Any) -> None:
    made = stopped(hand_made, runs=3)
    made.columns["ego"][1, 90, 3] = 5.0
    trace = with_shoulder(made, 2.5)
    ratings = {"stop": "planned", "ratings": {"slow_lane_in_sight": 0, "hard_shoulder": 2}}
    parameters = SafetyParameters.model_validate(ratings)
    channel = SafetyChannel(
        kind="safety", links=("channels.nominal",), rate="20 Hz", parameters=parameters
    )
    first = trace.layout.architecture
    other = first.model_copy(update={"channels": {"safety": channel}})
    mixed = replace(trace, layout=replace(trace.layout, architectures=(first, first, other)))
    rows = [measured(mixed, run) for run in range(3)]
    assert rows[0] == [("value", 3.0), ("value", 2.0)]
    assert [status for status, _ in rows[1]] == ["not_applicable"] * 2
    assert rows[2] == [("value", 0.0), ("value", 0.0)]
    for run in (0, 2):
        assert measured(mixed.select([run])) == rows[run]
        quality = rate_run(mixed, run)
        assert [quality.achieved, quality.regret] == [value for _, value in rows[run]]
