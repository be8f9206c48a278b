"""The closed loop: rows, ends of runs, shadow commands, and equal bits whatever the batch."""

from typing import Any

import numpy as np
import pytest

from adeye.errors import UsageError
from adeye.kernel.sight import ray_box_distance
from adeye.signals import EGO_HEADING, EGO_X, EGO_Y, REQUESTS_AUTHORITY, SILENT
from adeye.simulate import engine
from adeye.simulate.engine import EngineIdentity, identity
from adeye.sweep.case import TestCase
from adeye.trace import Trace
from tests.project import MINI, Project, odd_of, run_cases, use

STEP = 0.05
HORIZON, TAIL = 12.0, 13.0


@pytest.fixture(scope="module")
def sixteen(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[TestCase], Trace]:
    """Sixteen cut-ins of the candidate and their trace as one batch."""
    axes = {
        "ego_speed": ["70 km/h", "90 km/h", "110 km/h", "130 km/h"],
        "gap": ["10 m", "20 m", "40 m", "60 m"],
    }
    uses = use("cut_in", axes, faults=["front_camera_out"])
    odd = odd_of(uses, faults=MINI["faults"], architectures=("legacy_camera",))
    plan = Project(tmp_path_factory.mktemp("engine") / "project", odd).plan()
    cases = [case for case in plan.cases if case.fault_entry == "front_camera_out"]
    assert len(cases) == 16
    return cases, run_cases(plan, cases)


def test_batch_mixes_runs_that_end_at_different_rows(
    sixteen: tuple[list[TestCase], Trace],
) -> None:
    _, trace = sixteen
    assert len(set(trace.length.tolist())) > 1
    assert trace.complete.any()
    assert not trace.complete.all()


def test_a_cases_rows_end_with_the_horizon_and_its_tail(
    cut_ins: tuple[list[TestCase], Trace],
) -> None:
    _, trace = cut_ins
    whole = round((HORIZON + TAIL) / STEP) + 1
    assert trace.length.tolist() == [whole] * trace.runs
    assert trace.time[-1] == pytest.approx(HORIZON + TAIL)
    assert trace.horizon_row.tolist() == [round(HORIZON / STEP)] * trace.runs


def test_contact_ends_a_run_at_once_without_decision(sixteen: tuple[list[TestCase], Trace]) -> None:
    _, trace = sixteen
    for run in np.flatnonzero(~trace.complete).tolist():
        last = int(trace.length[run]) - 1
        assert trace["contact"][run, last] == 0
        assert (trace["contact"][run, :last] == -1).all()
        assert trace["impact_speed"][run, last] > 0.0
        assert not trace["ego"][run, last + 1 :].any()
    for run in range(trace.runs):
        last = int(trace.length[run]) - 1
        assert trace["ego"][run, last, EGO_X] > trace["ego"][run, 0, EGO_X]
        for name in ("acceleration", "stamp", "status", "command", "sensor_stamp"):
            assert not trace[name][run, last].any(), name


def test_every_channels_command_is_there_at_every_tick_under_its_id(
    cut_ins: tuple[list[TestCase], Trace],
) -> None:
    _, trace = cut_ins
    assert trace.layout.channels == ("nominal", "safety")
    rows = trace.length[0] - 1
    stamps = trace["stamp"][:, :rows]
    # Both answer every tick: safety at once, nominal after its compute time and until its fault.
    silent_from = round(3.0 / STEP)
    ages = trace.time[:rows, np.newaxis] - stamps
    assert ages[:, 1:, 1] == pytest.approx(0.0, abs=1e-9)
    assert ages[:, 1:silent_from, 0] == pytest.approx(STEP, abs=1e-9)
    assert (trace["status"][:, silent_from:rows, 0] == SILENT).all()
    assert np.isfinite(trace["acceleration"][:, :rows]).all()
    assert np.isfinite(trace["steering_angle"][:, :rows]).all()


def test_silence_of_the_nominal_channel_hands_over_to_the_safety_channel(
    cut_ins: tuple[list[TestCase], Trace],
) -> None:
    _, trace = cut_ins
    fault = np.argmax(trace["fault_active"][:, :, 0], axis=1)
    assert (trace.time[fault] <= 3.0 + 1e-9).all()
    for run in range(trace.runs):
        after = slice(int(fault[run]), round(3.5 / STEP))
        assert (trace["authority"][run, after] == 1).any()
        assert (trace["status"][run, after, 1] == REQUESTS_AUTHORITY).any()


def test_every_tick_is_announced_with_the_number_of_ended_runs(
    sixteen: tuple[list[TestCase], Trace],
) -> None:
    cases, trace = sixteen
    ended: list[int] = []
    engine.run(cases[:2], on_tick=ended.append)
    assert len(ended) == max(trace.length[:2]) - 1
    assert ended[-1] == 2
    assert ended == sorted(ended)


def test_identity_names_backend_variant_and_numerics() -> None:
    assert identity() == EngineIdentity("batch", "reference-1", engine.NUMERICS_VERSION)
    assert identity("batch", "fast").variant == "fast-2"
    assert identity("highway").variant.startswith("highway-env-")


def test_unknown_backend_or_variant_is_refused_with_what_there_is() -> None:
    with pytest.raises(UsageError, match="no traffic 'prescan'"):
        identity("prescan")
    with pytest.raises(UsageError, match="no variant 'exact'") as refused:
        identity("batch", "exact")
    assert "fast" in str(refused.value)


# --- the camera in closed loop --------------------------------------------------------------------

RAYS = 400


@pytest.fixture(scope="module")
def cut_out(tmp_path_factory: pytest.TempPathFactory) -> Trace:
    """A lead van that leaves the lane and uncovers a stopped car; the candidate's camera."""
    folder = tmp_path_factory.mktemp("cut_out")
    plan = Project(folder / "project", odd_of("cut_out_to_stopped")).plan()
    return run_cases(plan, [plan.cases[0]])


def visible_share(trace: Trace, row: int, target: int) -> float:
    """Share of the target's angular extent that a fan of rays from the camera finds uncovered."""
    camera: Any = trace.layout.architecture.sensors["front_camera"]
    ego = trace["ego"][0, row]
    x = ego[EGO_X] + camera.mount.x * np.cos(ego[EGO_HEADING])
    y = ego[EGO_Y] + camera.mount.x * np.sin(ego[EGO_HEADING])
    boxes = [
        (*trace["objects"][0, row, thing, :3], *trace.layout.context.object_sizes[0, thing, :2])
        for thing in range(len(trace.layout.context.object_ids))
    ]
    middle = np.arctan2(boxes[target][1] - y, boxes[target][0] - x)
    hits = seen = 0
    for bearing in middle + np.linspace(-0.1, 0.1, RAYS):
        direction = (float(np.cos(bearing)), float(np.sin(bearing)))
        distances = [ray_box_distance((x, y), direction, box) for box in boxes]
        if np.isfinite(distances[target]):
            hits += 1
            seen += distances[target] == min(distances)
    return seen / hits


def test_camera_reports_the_stopped_car_only_once_geometry_lets_it(cut_out: Trace) -> None:
    names = cut_out.layout.context.object_ids
    camera, car = cut_out.layout.sensors.index("front_camera"), names.index("stopped")
    reported = cut_out["detected"][0, : cut_out.length[0] - 1, camera, car]
    first = int(np.argmax(reported))
    assert reported[first]
    stamp = cut_out["sensor_stamp"][0, :, camera]
    sample, before = round(stamp[first] / STEP), round(stamp[first - 1] / STEP)
    # Half of it must be in sight, and it is reported with the first sample in which it is.
    assert visible_share(cut_out, sample, car) >= 0.5 - 2.0 / RAYS * 10
    within = cut_out["objects"][0, before, car, 0] - cut_out["ego"][0, before, 0] < 120.0
    assert not within or visible_share(cut_out, before, car) <= 0.5 + 2.0 / RAYS * 10
    assert cut_out.time[sample] > 2.0, "the van does not leave before"
