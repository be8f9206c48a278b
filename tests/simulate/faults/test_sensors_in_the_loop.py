"""Faults of sensors in closed loop: identities of the trace, and numbers that are none."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.campaign.plan import CampaignPlan
from adeye.signals import SILENT
from adeye.spec.fault import FAULT
from adeye.sweep.case import TestCase
from adeye.trace import Trace
from tests.project import MINI, Project, run_cases
from tests.simulate.faults.test_closed_loop import first_difference

ONSET = 2.0


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> tuple[CampaignPlan, TestCase]:
    """One cut-in of the candidate without a fault."""
    odd = {
        **MINI,
        "scenarios": [{"use": "cut_in", "faults": ["none"]}],
        "architectures": ["architectures/camera_radar.yaml"],
    }
    plan = Project(tmp_path_factory.mktemp("loop") / "project", odd).plan()
    return plan, plan.cases[0]


@pytest.fixture(scope="module")
def twin(planned: tuple[CampaignPlan, TestCase]) -> Trace:
    plan, case = planned
    return run_cases(plan, [case])


def faulty(
    planned: tuple[CampaignPlan, TestCase], faults: Sequence[dict[str, Any]], *, runs: int = 1
) -> Trace:
    plan, case = planned
    made = tuple(
        FAULT.validate_python({"id": f"f{k}", "onset": {"at": f"{ONSET} s"}, **fault})
        for k, fault in enumerate(faults)
    )
    return run_cases(plan, [replace(case, faults=made, fault_entry="all")] * runs)


REAL: list[dict[str, Any]] = [
    {"target": "sensors.front_radar", "model": "bias", "signal": "x", "size": "-5 m"},
    {"target": "sensors.front_camera", "model": "miss", "probability": 0.5},
    {"target": "sensors.localisation", "model": "jump", "y": "1 m"},
    {"target": "sensors.front_radar", "model": "ghost", "x": "25 m", "speed": "5 m/s"},
    {"target": "sensors.truth", "model": "freeze"},
]


@pytest.mark.slow
@pytest.mark.parametrize("fault", REAL, ids=lambda fault: fault["model"])
def test_trace_is_that_of_the_twin_up_to_the_onset_and_another_from_there(
    planned: tuple[CampaignPlan, TestCase], twin: Trace, fault: dict[str, Any]
) -> None:
    trace = faulty(planned, [fault])
    found = first_difference(trace, twin)
    assert found is not None
    onset = round(ONSET / (twin.time[1] - twin.time[0]))
    # Detections are drawn, so what is reported shows at once; nothing shows before.
    assert onset <= found <= onset + 4


@pytest.mark.slow
def test_equal_runs_of_a_batch_have_equal_faults(planned: tuple[CampaignPlan, TestCase]) -> None:
    both = faulty(planned, REAL, runs=2)
    alone = faulty(planned, REAL)
    for name, values in both.columns.items():
        assert values[0].tobytes() == values[1].tobytes()
        assert values[0].tobytes() == alone.columns[name][0].tobytes()


FLIPS = [
    (sensor, signal)
    for sensor, signals in {
        "front_radar": ("x", "y", "range", "bearing", "range_rate", "length", "width"),
        "front_camera": ("x", "y", "length", "width"),
        "truth": ("x", "y", "range_rate", "ego_x", "ego_y", "ego_heading", "ego_speed"),
        "localisation": ("ego_x", "ego_y", "ego_heading", "ego_speed", "ego_yaw_rate"),
    }.items()
    for signal in signals
]


@pytest.mark.slow
@pytest.mark.parametrize("bit", [62, 61, 55, 63])
def test_no_flipped_bit_ends_the_loop(planned: tuple[CampaignPlan, TestCase], bit: int) -> None:
    """Each signal of each sensor in turn, intermittently, so that the channels come back to it."""
    for sensor, signal in FLIPS:
        flip = {"target": f"sensors.{sensor}", "model": "bit_flip", "signal": signal, "bit": bit}
        trace = faulty(planned, [{**flip, "duration": "0.3 s", "every": "1 s"}])
        rows = int(trace.length[0]) - 1
        for name in ("ego", "command", "acceleration", "steering_angle"):
            assert np.isfinite(trace.columns[name][0, :rows]).all(), (sensor, signal, name)
        assert np.isfinite(trace.columns["ego"][0, rows]).all(), (sensor, signal)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("signal", "one"), [("ego_x", "1 m"), ("ego_heading", "1 rad"), ("ego_speed", "1 m/s")]
)
def test_ego_estimate_without_numbers_is_not_used_and_the_safety_channel_acts(
    planned: tuple[CampaignPlan, TestCase], signal: str, one: str
) -> None:
    """All bits of the exponent make no number of what is stuck there."""
    target = {"target": "sensors.localisation", "signal": signal}
    # The exponent of 1 is 1023: its highest bit makes 2047, which with no fraction is infinite.
    stuck = {**target, "model": "stuck_at", "value": one}
    trace = faulty(planned, [stuck, {**target, "model": "bit_flip", "bit": 62}])
    rows = int(trace.length[0]) - 1
    assert np.isfinite(trace.columns["command"][0, :rows]).all()
    nominal = trace.layout.channels.index("nominal")
    status = trace.columns["status"][0, :rows, nominal]
    late = trace.time[:rows] > ONSET + 1.0
    assert (status[late] != 0).all()
    assert status[late][-1] in (1, 2, 3, SILENT)
