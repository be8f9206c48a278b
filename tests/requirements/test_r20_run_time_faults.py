"""R20: faults of every part begin by time, by condition or at random while a run goes on."""

from typing import Any

import numpy as np
import pytest

from adeye.signals import FAULT, SILENT
from adeye.trace import Trace
from tests.conftest import MakeProject
from tests.motorway import fault
from tests.project import CANDIDATE, MINI, Project, odd_of, run_cases, use
from tests.requirements.loop import invite

pytestmark = pytest.mark.requirements

BY_CONDITION = fault("blind_when_near", "sensors.front_radar", "drop_out", duration="1 s") | {
    "onset": {"when": "cutter.gap <= 36 m"}
}


def driven(project: Project) -> dict[str, Trace]:
    """Run each test case by itself; by its faults."""
    plan = project.plan()
    return {case.fault_entry: run_cases(plan, [case]) for case in plan.cases}


@pytest.fixture(scope="module")
def traces(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Trace]:
    """One cut-in of the candidate without and with each fault, and with two at once."""
    single = ["none", "front_camera_out", "nominal_silent", "blind_when_near"]
    uses = use("cut_in", faults=[*single, ["front_camera_out", "blind_when_near"]])
    odd = odd_of(uses, faults=[*MINI["faults"], BY_CONDITION])
    return driven(Project(tmp_path_factory.mktemp("faults") / "project", odd))


def rows_of_fault(trace: Trace, name: str) -> np.ndarray[Any, np.dtype[np.bool_]]:
    active = trace["fault_active"][0, : trace.length[0] - 1, trace.layout.faults.index(name)]
    return np.asarray(active, dtype=np.bool_)


def test_sensor_drops_out_from_its_time_for_its_duration(traces: dict[str, Trace]) -> None:
    trace = traces["front_camera_out"]
    active = rows_of_fault(trace, "front_camera_out")
    times = trace.time[: active.size][active]
    assert (times[0], times[-1]) == (pytest.approx(2.0), pytest.approx(4.95))
    camera = trace.layout.sensors.index("front_camera")
    alive = trace["sensor_alive"][0, : active.size, camera]
    assert np.array_equal(alive, ~active)
    assert not trace["detected"][0, : active.size, camera][active].any()


def test_channel_falls_silent_and_another_takes_over(traces: dict[str, Trace]) -> None:
    trace = traces["nominal_silent"]
    active = rows_of_fault(trace, "nominal_silent")
    assert (trace["status"][0, : active.size, 0][active] == SILENT).all()
    assert trace["authority"][0, active.size - 1] == trace.layout.channels.index("safety")


def test_fault_begins_when_its_condition_first_holds(traces: dict[str, Trace]) -> None:
    trace = traces["blind_when_near"]
    active = rows_of_fault(trace, "blind_when_near")
    first = int(np.argmax(active))
    assert first > 0
    assert active.sum() == round(1.0 / 0.05)
    ego, cutter = trace["ego"][0], trace["objects"][0, :, 0]
    half = 0.5 * (trace.layout.context.ego_size[0, 0] + trace.layout.context.object_sizes[0, 0, 0])
    gap = cutter[:, 0] - ego[:, 0] - half
    assert gap[first] <= 36.0 < gap[first - 1]


def test_two_faults_at_once(traces: dict[str, Trace]) -> None:
    trace = traces["front_camera_out+blind_when_near"]
    assert set(trace.layout.faults) == {"front_camera_out", "blind_when_near"}
    assert all(rows_of_fault(trace, name).any() for name in trace.layout.faults)


def test_run_is_the_fault_free_one_to_the_bit_until_the_fault(traces: dict[str, Trace]) -> None:
    none = traces["none"]
    for name, trace in traces.items():
        active = trace["fault_active"][0].any(axis=-1)
        until = int(np.argmax(active)) if active.any() else int(trace.length[0])
        assert until > 5 or name == "none"
        for column in ("ego", "objects", "acceleration", "command", "authority"):
            assert np.array_equal(none[column][0, :until], trace[column][0, :until]), column


@pytest.mark.slow
def test_fault_that_never_begins_leaves_every_bit(make_project: MakeProject) -> None:
    project = make_project()
    with project.edited_odd() as odd:
        odd["faults"][0]["onset"] = {"when": "ego.speed > 90 m/s"}
    plan = project.plan()
    first = [case for case in plan.cases if case.scenario_id == "cut_in"]
    twin = next(case for case in first if case.fault_entry == "none")
    late = next(
        case
        for case in first
        if case.fault_entry == "front_camera_out" and case.situation_digest == twin.situation_digest
    )
    one, other = run_cases(plan, [twin]), run_cases(plan, [late])
    for name, column in one.columns.items():
        if not name.startswith("fault"):
            np.testing.assert_array_equal(column, other.columns[name], err_msg=name)


EVERY_PART: list[dict[str, Any]] = [
    {"target": "sensors.front_radar", "model": "bias", "signal": "range", "size": "3 m"},
    {"target": "channels.nominal", "model": "bias", "acceleration": "-2 m/s^2"},
    {"target": "hooks.nominal", "model": "map_shifted", "offset": "0.5 m"},
    {"target": "links.nominal.front_radar", "model": "delay", "by": "0.3 s"},
    {"target": "actuators.brake", "model": "loss", "share": 0.8},
    {"target": "tyres", "model": "friction", "value": 0.1},
    {"target": "switch", "model": "stuck"},
]


@pytest.mark.slow
def test_every_part_can_fail_from_its_onset_on(make_project: MakeProject) -> None:
    faults = [
        {**fault, "id": fault["target"].replace(".", "_"), "onset": {"between": ["1 s", "2 s"]}}
        for fault in EVERY_PART
    ]
    names = [fault["id"] for fault in faults]
    # The switch, the last, has something to do only when the nominal channel fails.
    entries = [*names[:-1], "nominal_silent", ["nominal_silent", "switch"]]
    axes = {"deceleration": ["6 m/s^2"], "time_gap": ["1.2 s"]}
    uses = use("lead_braking", axes, faults=entries)
    found = driven(make_project(odd_of(uses, faults=[*faults, MINI["faults"][1]])))
    for name in names:
        is_last = name == "switch"
        entry, twin = ("switch+nominal_silent", "nominal_silent") if is_last else (name, "none")
        active = rows_of_fault(found[entry], name)
        onset = int(np.argmax(active))
        assert 1.0 <= found[entry].time[onset] <= 2.05, name
        ego, other = found[entry]["ego"][0], found[twin]["ego"][0]
        rows = min(ego.shape[0], other.shape[0])
        differs = (ego[:rows] != other[:rows]).any(axis=1)
        assert differs.any(), name
        assert int(np.argmax(differs)) > onset, name


@pytest.mark.slow
def test_program_as_channel_fails_like_any_other(make_project: MakeProject) -> None:
    faults = [
        fault("dead", "channels.guest", "crash", "2 s"),
        fault("deaf", "links.guest.localisation", "drop", "2 s"),
    ]
    project = make_project(odd_of(use("lead_braking", faults=["dead", "deaf"]), faults=faults))
    invite(project)
    found = driven(project)
    onset = round(2.0 / 0.05)
    guest = found["none"].layout.channels.index("guest")
    status = found["dead"]["status"][0, : found["dead"].length[0] - 1, guest]
    assert (status[onset:] == SILENT).all()
    assert (status[1:onset] != SILENT).all()
    # It acts on nothing that it is not shown; who has authority is not deceived.
    for name in ("dead", "deaf"):
        one, other = found[name], found["none"]
        assert one["ego"].tobytes() == other["ego"].tobytes()
        assert one["acceleration"][0, :, 0].tobytes() == other["acceleration"][0, :, 0].tobytes()


@pytest.mark.slow
def test_planned_stop_can_be_deprived_of_its_view_and_says_so(make_project: MakeProject) -> None:
    lost = fault("lost", "links.safety.truth", "drop", "2 s")
    project = make_project(odd_of(use("lead_braking", faults=["lost"]), faults=[lost]))
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["safety"]["parameters"] = {"stop": "planned"}
    trace = driven(project)["lost"]
    safety = trace.layout.channels.index("safety")
    status = trace["status"][0, : trace.length[0] - 1, safety]
    # Without a recent ego estimate it is in fault: the last one was one tick and a latency old.
    status = status[round(2.0 / 0.05) :]
    first = int(np.argmax(status == FAULT))
    assert first * 0.05 == pytest.approx(0.5 - 0.1 + 0.05, abs=0.051)
    assert (status[first:] == FAULT).all()
