"""Links of health: a supervisor watches sensors of another channel, and nothing of content."""

import shutil
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from adeye.campaign.plan import make_plan, signal_table
from adeye.errors import InputError
from adeye.judge.timeline import timeline
from adeye.signals import MANOEUVRE_MONITORS
from adeye.simulate import engine
from adeye.sweep.case import TestCase, structure_key
from adeye.trace import Trace
from tests.motorway import fault
from tests.project import MINI, Project

STEP, PERIOD, ONSET, TIMEOUT = 0.05, 0.1, 3.0, 0.1
SUPERVISED = "odd/architectures/supervised_adeye.yaml"
HEALTH_LINK = "links.safety.health.front_camera"
SUPERVISOR = "architecture.channels.safety.parameters.supervisor"
FAULTS = {
    "camera": ("sensors.front_camera", "drop_out", {}),
    "killed": ("channels.nominal", "crash", {}),
    "unheard": (HEALTH_LINK, "drop", {}),
    "late": (HEALTH_LINK, "delay", {"by": "0.5 s"}),
    "null": (HEALTH_LINK, "delay", {"by": "0 s"}),
}


def odd(**scenario: Any) -> dict[str, Any]:
    faults = [
        fault(name, target, model, f"{ONSET} s", **more)
        for name, (target, model, more) in FAULTS.items()
    ]
    return {
        **MINI,
        "scenarios": [{"use": "lead_braking", **scenario}],
        "faults": faults,
        "architectures": ["architectures/supervised_adeye.yaml"],
        "gate": {"architectures": ["supervised_adeye"]},
    }


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Project]:
    folder = tmp_path_factory.mktemp("health") / "project"
    yield Project(folder, odd())
    shutil.rmtree(folder)


@pytest.fixture(scope="module")
def runs(project: Project) -> dict[str, Trace]:
    plan = project.plan()
    return {case.fault_entry: engine.run([case], base_dirs=plan.folders) for case in plan.cases}


def confirmed_at(trace: Trace, monitor: str, column: int = 1) -> float:
    flags = trace["monitors"][0, :, trace.layout.monitors.index(monitor), column]
    assert flags.any()
    return float(trace.time[int(np.argmax(flags))])


def asked_at(time: float) -> float:
    """Return when the supervisor asks its monitors, from a time on [s]."""
    return float(np.ceil(time / PERIOD - 1e-6) * PERIOD)


def test_dead_sensor_is_confirmed_by_timeout_and_evaluations(runs: dict[str, Trace]) -> None:
    # The last sample came a tick before, and a sample that is just as old is old enough.
    found = asked_at(ONSET - STEP + TIMEOUT + STEP)
    assert confirmed_at(runs["camera"], "front_camera_alive", 0) == pytest.approx(found)
    expected = found + 7 * PERIOD
    assert confirmed_at(runs["camera"], "front_camera_alive") == pytest.approx(expected)
    assert confirmed_at(runs["camera"], "mrm_roadside_parking") == pytest.approx(expected)


def test_killed_channel_is_confirmed_by_timeout_and_evaluations(runs: dict[str, Trace]) -> None:
    trace = runs["killed"]
    index = trace.layout.channels.index("nominal")
    last = float(trace["stamp"][0, : int(trace.length[0]) - 1, index].max())
    # Too old is more than the timeout, by a tick, and the link shows the tick before.
    found = asked_at(last + TIMEOUT + STEP)
    assert confirmed_at(trace, "nominal_silent", 0) == pytest.approx(found)
    assert confirmed_at(trace, "nominal_silent") == pytest.approx(found + 7 * PERIOD)
    told = timeline(trace, 0, runs["none"], 0)
    assert told.detect_s is not None
    # The switch may know of a dead channel before the monitor does.
    assert told.detect_s <= found + 7 * PERIOD + 1e-9


def test_what_tells_the_manoeuvre_is_no_detection_of_its_own(runs: dict[str, Trace]) -> None:
    told = timeline(runs["camera"], 0, runs["none"], 0)
    assert told.detect_s == pytest.approx(confirmed_at(runs["camera"], "front_camera_alive"))


def test_fault_of_the_health_link_is_seen_by_the_supervisor_only(runs: dict[str, Trace]) -> None:
    for name in ("unheard", "late"):
        trace = runs[name]
        assert confirmed_at(trace, "front_camera_alive", 0) >= ONSET
        rows = trace.time < confirmed_at(trace, "front_camera_alive", 0)
        nominal = trace.layout.channels.index("nominal")
        for column in ("acceleration", "steering_angle"):
            one, other = trace[column][0, rows, nominal], runs["none"][column][0, rows, nominal]
            assert one.tobytes() == other.tobytes()
    assert runs["null"].digests()[0] != ""
    for column in ("ego", "command", "monitors", "acceleration"):
        assert runs["null"][column].tobytes() == runs["none"][column].tobytes()


@pytest.mark.slow
def test_batch_of_several_decides_as_each_alone(project: Project) -> None:
    folder = project.folder.with_name("swept")
    swept = Project(
        folder,
        odd(
            faults=["camera"],
            sweep={
                "parameters": {
                    f"{SUPERVISOR}.counter.fault": [1, 4],
                    f"{SUPERVISOR}.monitors.front_camera_alive.timeout": ["0.1 s", "0.4 s"],
                    f"{SUPERVISOR}.monitors.front_camera_alive.level": [3, 4],
                    f"{SUPERVISOR}.manoeuvres.3": ["roadside_parking", "stop"],
                }
            },
        ),
    )
    plan = swept.plan()
    cases: list[TestCase] = [case for case in plan.cases if case.fault_entry == "camera"]
    assert len(cases) == 16
    assert len({structure_key(case) for case in cases}) == 1
    together = engine.run(cases, base_dirs=plan.folders)
    # Level 4, and level 3 where it asks for the same, stop alike.
    assert len(set(together.digests())) == 8
    for number in (0, 5, 15):
        alone = engine.run([cases[number]], base_dirs=plan.folders)
        assert alone.digests()[0] == together.digests()[number]
    flags = together["monitors"][:, :, together.layout.monitors.index("front_camera_alive"), 1]
    assert {round(float(together.time[int(np.argmax(run))]), 9) for run in flags} == {
        3.1 + 0.4,
        3.1 + 0.7,
        3.4 + 0.4,
        3.4 + 0.7,
    }


def test_what_is_watched_is_structure(project: Project) -> None:
    text = (project.folder / SUPERVISED).read_text("utf-8")
    keys = set()
    for new in ("watches: [rear_camera]", "watches: [front_radar]"):
        changed = text.replace("watches: [rear_camera]", new).replace(
            "architecture: supervised_adeye", "architecture: other"
        )
        path = project.folder / "odd" / "architectures" / "other.yaml"
        path.write_text(changed, "utf-8")
        content = odd(faults=["none"])
        content["architectures"] = ["architectures/other.yaml"]
        content["gate"] = {"architectures": ["other"]}
        keys.add(structure_key(make_plan(project.write("odd/other.yaml", content)).cases[0]))
    assert len(keys) == 2


def test_requirements_may_name_the_monitors_and_the_manoeuvre(project: Project) -> None:
    names = {row.name for row in signal_table(project.plan())}
    for monitor in ("front_camera_alive", "object_danger", *MANOEUVRE_MONITORS):
        assert {f"monitor.{monitor}.raw", f"monitor.{monitor}.confirmed"} <= names


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("      - health.front_camera\n", "", "add health.front_camera to its links"),
        ("watches: [rear_camera]", "watches: [camera]", "no sensor: corner_radar, front_camera"),
        ("watches: [nominal]", "watches: [safety]", "add channels.safety to its links"),
        (
            "      - health.rear_camera\n",
            "      - health.rear\n",
            "none of corner_radar, front_camera",
        ),
        ("rate: 10 Hz\n        counter", "rate: 7 Hz\n        counter", "10 Hz"),
        ("3: roadside_parking", "3: continue", "milder"),
    ],
)
def test_error_names_line_and_remedy(project: Project, old: str, new: str, message: str) -> None:
    path = project.folder / SUPERVISED
    text = path.read_text("utf-8")
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), "utf-8")
    try:
        with pytest.raises(InputError) as caught:
            project.plan()
    finally:
        path.write_text(text, "utf-8")
    assert message in str(caught.value)
    assert "supervised_adeye.yaml:" in str(caught.value)
