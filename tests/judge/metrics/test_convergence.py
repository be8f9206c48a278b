"""Every metric of a shipped scenario converges with the step, or is known not to."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from adeye import plan
from adeye.judge.metrics import METRICS, compute_metrics
from adeye.signals import EGO_ACCELERATION, EGO_SPEED
from adeye.simulate import engine
from adeye.sweep.case import TestCase
from adeye.trace import Trace

FOLDER = Path(__file__).parents[3] / "odd"
STEPS = (0.05, 0.0125, 0.003125)
"""Quarters, because the row at which a conflict begins falls anywhere within a step."""

DECIDED = frozenset({
    "takeovers", "trips", "nominal_availability", "takeover_time_s", "fault_detection_time_s",
    "fault_reaction_time_s", "fault_handling_time_s", "emergency_operation_time_s",
    "detection_latency_s", "missed_time_s", "false_track_time_s",
})  # fmt: skip
"""What a decision settles that can fall a tick earlier, as the guide says."""


OF_ROWS = {"s": 2.0 * STEPS[1], "s²": 6.0 * STEPS[1], "1": 0.01}
"""What two rows count, by the unit of a metric: a time below 3 s is integrated, or a share."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "odd", ["motorway_chauffeur", "urban_pedestrian_rain", "sensor_study", "fault_campaign"]
)
def test_metrics_converge_with_the_step(odd: str) -> None:
    """Each quartering changes a metric by less, or by no more than 2 % or than two rows count.

    The first test case without a fault of each scenario, of another architecture each. Where a
    channel comes to decide otherwise, because a sample falls a tick earlier, it is another drive
    that is measured: such drives are left out, and are the fewer.
    """
    planned = plan(FOLDER / f"{odd}.yaml")
    found: dict[str, dict[str, TestCase]] = {}
    for case in planned.expansion.cases():
        if not case.faults:
            of = found.setdefault(case.scenario_id, {})
            of.setdefault(case.architecture.architecture, case)
    cases = {
        name: list(of.values())[place % len(of)] for place, (name, of) in enumerate(found.items())
    }
    compared = 0
    for key, case in cases.items():
        drives = [
            engine.run([replace(case, step=step)], base_dirs=planned.folders) for step in STEPS
        ]
        if not is_one_drive(drives):
            continue
        compared += 1
        measured = [compute_metrics(drive) for drive in drives]
        for name in sorted(METRICS.keys() - DECIDED):
            columns = [metrics[name] for metrics in measured]
            if {column.status[0] for column in columns} != {"value"}:
                continue
            cap = METRICS[name].cap
            values = [min(float(column.value[0]), cap or np.inf) for column in columns]
            first, second = (abs(b - a) for a, b in pairwise(values))
            rest = max(0.02 * abs(values[2]) + 1e-6, OF_ROWS.get(METRICS[name].unit, 0.0))
            assert second <= max(0.75 * first, rest), (key, name, values)
    assert compared > len(cases) / 2


def is_one_drive(drives: Sequence[Trace]) -> bool:
    """Whether speed and acceleration of the ego converge themselves, at the common times."""
    times = [round(STEPS[0] / step) for step in STEPS]
    length = min(
        int(drive.length[0] - 1) // every for drive, every in zip(drives, times, strict=True)
    )
    for column, slack in ((EGO_SPEED, 0.005), (EGO_ACCELERATION, 0.05)):
        told = [
            drive["ego"][0, : length * every + 1 : every, column]
            for drive, every in zip(drives, times, strict=True)
        ]
        first, second = (np.abs(b - a).max() for a, b in pairwise(told))
        if second > max(0.75 * first, slack):
            return False
    return True
