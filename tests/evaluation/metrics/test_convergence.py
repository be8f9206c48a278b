"""Every metric of a shipped scenario converges as the step is halved, or is known not to."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from adeye import engine, plan
from adeye.evaluation.metrics import METRICS, compute_metrics

if TYPE_CHECKING:
    from adeye.sweep.case import TestCase

FOLDER = Path(__file__).parents[3] / "odd"
STEPS = (0.05, 0.025, 0.0125)

DECIDED = frozenset({
    "takeovers", "trips", "nominal_availability", "takeover_time_s", "fault_detection_time_s",
    "fault_reaction_time_s", "fault_handling_time_s", "emergency_operation_time_s",
    "detection_latency_s", "missed_time_s", "false_track_time_s",
})  # fmt: skip
"""What a decision settles that can fall a tick earlier, as the guide says."""


@pytest.mark.parametrize("odd", ["motorway_chauffeur", "urban_pedestrian_rain"])
def test_metrics_converge_as_the_step_is_halved(odd: str) -> None:
    """Each halving changes a metric by less, or by no more than 2 % or than two rows count.

    The first test case without a fault of each scenario and architecture.
    """
    planned = plan(FOLDER / f"{odd}.yaml")
    cases: dict[tuple[str, str], TestCase] = {}
    for case in planned.expansion.cases():
        if not case.faults:
            cases.setdefault((case.scenario_id, case.architecture.architecture), case)
    compared = 0
    for key, case in cases.items():
        found = [
            compute_metrics(engine.run([replace(case, step=step)], base_dirs=planned.folders))
            for step in STEPS
        ]
        for name in sorted(METRICS.keys() - DECIDED):
            columns = [metrics[name] for metrics in found]
            if {column.status[0] for column in columns} != {"value"}:
                continue
            values = [float(column.value[0]) for column in columns]
            first, second = (abs(b - a) for a, b in pairwise(values))
            rest = 0.02 * abs(values[2]) + 1e-6
            if METRICS[name].unit in {"s", "s²"}:
                rest = max(rest, 2.0 * STEPS[1])
            assert second <= max(0.75 * first, rest), (key, name, values)
            compared += 1
    assert compared > 20 * len(cases)
