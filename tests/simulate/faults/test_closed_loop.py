"""Faults of every kind of part in closed loop: what does nothing changes no bit of the trace."""

from typing import Any

import numpy as np
import pytest

from adeye.simulate import engine
from adeye.sweep.case import TestCase
from adeye.trace import Trace
from tests.project import MINI, Project

STEP = 0.05
ONSET = 4.0
NEVER = "ego.speed > 90 m/s"

STRONG: list[tuple[str, str, dict[str, Any]]] = [
    ("channels.nominal", "bias", {"acceleration": "-1 m/s^2"}),
    ("channels.nominal", "not_a_number", {}),
    ("links.safety.channels.nominal", "delay", {"by": "0.5 s"}),
    ("links.nominal.front_camera", "drop", {}),
    ("links.nominal.front_radar", "drop", {"probability": 0.5}),
    ("hooks.nominal", "map_shifted", {"offset": "0.5 m"}),
    ("hooks.nominal", "tracks_lost", {}),
    ("actuators.brake", "loss", {"share": 0.7}),
    ("actuators.steering", "offset", {"steering_angle": "0.2 deg"}),
    ("tyres", "friction", {"value": 0.1}),
]
ZERO: list[tuple[str, str, dict[str, Any]]] = [
    ("channels.nominal", "bias", {"acceleration": "0 m/s^2"}),
    ("channels.nominal", "slow", {"by": "0 s"}),
    ("links.nominal.front_camera", "delay", {"by": "0 s"}),
    ("links.safety.channels.nominal", "drop", {"probability": 0.0}),
    ("links.safety.switch", "delay", {"by": "0 s"}),
    ("hooks.nominal", "map_shifted", {"offset": "0 m"}),
    ("actuators.brake", "loss", {"share": 0.0}),
    ("actuators.steering", "delay", {"by": "0 s"}),
    ("tyres", "friction", {"factor": 1.0}),
]


def fault(number: int, what: tuple[str, str, dict[str, Any]], **times: Any) -> dict[str, Any]:
    target, model, more = what
    onset = {"onset": {"at": f"{ONSET} s"}}
    return {"id": f"f{number}", "target": target, "model": model, **onset, **more, **times}


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, TestCase], dict[str, Trace]]:
    """One cut-in with every fault above: as it is, without amplitude, without onset."""
    faults = [
        *(fault(100 + at, what) for at, what in enumerate(STRONG)),
        *(fault(200 + at, what) for at, what in enumerate(ZERO)),
        *(fault(300 + at, what, onset={"when": NEVER}) for at, what in enumerate(STRONG)),
    ]
    odd = {
        **MINI,
        "scenarios": [{"use": "lead_braking"}],
        "faults": faults,
        "architectures": ["architectures/camera_radar.yaml"],
    }
    plan = Project(tmp_path_factory.mktemp("parts") / "project", odd).plan()
    cases = {case.fault_entry: case for case in plan.cases}
    return cases, {name: engine.run([case], base_dirs=plan.folders) for name, case in cases.items()}


def first_difference(one: Trace, other: Trace) -> int | None:
    """Return the first row in which two traces of one run differ beside the faults."""
    rows = min(int(one.length[0]), int(other.length[0]))
    found = [] if one.length[0] == other.length[0] else [rows]
    for name in sorted(set(one.columns) - {"fault_active"}):
        a, b = one[name][0, :rows], other[name][0, :rows]
        found += [row for row in range(rows) if a[row].tobytes() != b[row].tobytes()][:1]
    return min(found) if found else None


def test_zero_amplitude_and_onset_that_never_comes_change_no_bit(runs: Any) -> None:
    _, traces = runs
    for first, faults, is_active in ((200, ZERO, True), (300, STRONG, False)):
        for number, what in enumerate(faults, first):
            trace = traces[f"f{number}"]
            assert first_difference(trace, traces["none"]) is None, what
            assert trace["fault_active"].any() == is_active, what


@pytest.mark.parametrize("at", range(len(STRONG)), ids=[f"{t}-{m}" for t, m, _ in STRONG])
def test_effect_begins_with_the_onset(at: int, runs: Any) -> None:
    _, traces = runs
    trace, twin = traces[f"f{100 + at}"], traces["none"]
    onset = round(ONSET / STEP)
    assert np.argmax(trace["fault_active"][0, :, 0]) == onset
    differs = first_difference(trace, twin)
    assert differs is not None
    assert differs >= onset
    target = STRONG[at][0]
    if target.startswith("channels"):
        assert differs == onset
    if target == "actuators.steering":
        # The command of the onset moves the ego until the row after it.
        assert differs == onset + 1


def test_only_the_channel_behind_a_faulty_link_is_deceived(runs: Any) -> None:
    _, traces = runs
    trace, twin = traces["f103"], traces["none"]
    onset, channel = round(ONSET / STEP), trace.layout.channels.index("safety")
    row = first_difference(trace, twin)
    assert row is not None
    # What is recorded of the sensor is what it delivers, whoever is shown something else.
    for name in ("sensor_stamp", "sensor_alive"):
        assert np.array_equal(trace[name][0, : row + 1], twin[name][0, : row + 1])
    for name in ("acceleration", "steering_angle", "status"):
        rows = slice(onset, row + 1)
        assert np.array_equal(trace[name][0, rows, channel], twin[name][0, rows, channel])


def test_recorded_command_is_what_the_switch_decided(runs: Any) -> None:
    _, traces = runs
    trace = traces["f107"]
    rows = int(trace.length[0]) - 1
    acting = trace["authority"][0, :rows]
    given = trace["acceleration"][0, :rows][np.arange(rows), np.maximum(acting, 0)]
    assert np.array_equal(trace["command"][0, :rows, 0][acting >= 0], given[acting >= 0])


def test_no_number_hands_over_and_is_never_acted_on(runs: Any) -> None:
    _, traces = runs
    trace = traces["f101"]
    rows, onset = int(trace.length[0]) - 1, round(ONSET / STEP)
    assert np.isnan(trace["acceleration"][0, onset:rows, 0]).all()
    assert np.isfinite(trace["command"][0, :rows]).all()
    assert (trace["authority"][0, onset:rows] == trace.layout.channels.index("safety")).all()


@pytest.mark.slow
def test_batch_has_the_bits_of_its_runs(runs: Any) -> None:
    cases, traces = runs
    for name in ("f104", "f105", "f107"):
        together = engine.run([cases[name]] * 2)
        assert together.digests() == traces[name].digests() * 2
