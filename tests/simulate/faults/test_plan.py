"""The plan of the faults of a batch: when each begins and ends in each run, and where it acts."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.errors import SpecError
from adeye.signals import SILENT, ControlCommand, Measurement, Scene, SceneContext
from adeye.simulate.channels.links import View
from adeye.simulate.faults import FaultPlan, schedule
from adeye.simulate.faults.injector import InjectorContext, Moment
from adeye.spec.architecture import Architecture
from adeye.spec.fault import FAULT
from adeye.sweep.case import TestCase
from adeye.testing.sensors import scene_of, three_objects
from tests import motorway
from tests.motorway import fault, make_case, make_scenario
from tests.simulate.faults import flows
from tests.simulate.faults.flows import sample

STEP = 0.05
CAMERA_OUT = fault("camera_out", "sensors.front", "drop_out", "0.2 s", duration="0.15 s")
NOMINAL_SILENT: dict[str, Any] = {
    "id": "nominal_silent",
    "target": "channels.nominal",
    "model": "silent",
    "onset": {"when": "lead.gap < 30 m"},
}
WALL = {"kind": "barrier", "s": "70 m", "offset": "1.75 m"}
SIZE = {"length": "3 m", "width": "1 m", "height": "1 m"}
SCENARIO = make_scenario(
    parameters={"delay": {"default": "1 s"}},
    world={"objects": {"wall": WALL | SIZE}},
    ego={"s": "0 m", "speed": "20 m/s"},
    actors={
        name: {"kind": "car", "start": {"lane": 1, "s": "40 m", "speed": "8 m/s"}}
        for name in ("lead", "neighbour")
    },
)
ARCHITECTURE = Architecture.model_validate(
    {
        **motorway.ARCHITECTURE,
        "sensors": {name: {"kind": "ground_truth", "rate": "20 Hz"} for name in ("front", "rear")},
        "channels": {name: {"kind": name, "links": ["front"]} for name in ("nominal", "safety")},
        "switch": {
            "policy": "fixed_priority",
            "priority": ["safety", "nominal"],
            "default": "nominal",
        },
    }
)
CONTEXT: SceneContext = three_objects()
"""Three runs in which the ego drives 10, 15 and 20 m/s, and the lead 40 m ahead 8 m/s."""


def case(*faults: Mapping[str, Any], delay: float = 1.0) -> TestCase:
    return replace(
        make_case(SCENARIO, {"delay": delay}),
        architecture=ARCHITECTURE,
        faults=tuple(FAULT.validate_python(fault) for fault in faults),
        fault_entry="+".join(fault["id"] for fault in faults) or "none",
    )


def scenes(ticks: int) -> list[Scene]:
    return [scene_of(CONTEXT, tick) for tick in range(ticks)]


def active_ticks(*cases: TestCase, ticks: int, run: int = 0) -> list[int]:
    """Return the ticks at which the first fault is active in a run; one case is that of all."""
    found: list[int] = np.flatnonzero(activity(cases, ticks)[:, run, 0]).tolist()
    return found


def activity(cases: Sequence[TestCase], ticks: int) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """(T, B, F)."""
    plan = FaultPlan(list(cases) * (3 // len(cases)), CONTEXT)
    return np.array([plan.update(scene) for scene in scenes(ticks)])


def reading(time: float) -> Measurement:
    return sample(time, runs=3)


def command(channel: str, time: float) -> ControlCommand:
    return flows.command(time, channel=channel, runs=3)


def test_fault_is_present_from_its_onset_for_its_duration_or_to_the_end() -> None:
    assert active_ticks(case(CAMERA_OUT), ticks=10) == [4, 5, 6]
    assert active_ticks(case({**CAMERA_OUT, "duration": None}), ticks=30) == list(range(4, 30))
    # Times vary from run to run.
    late = {**CAMERA_OUT, "onset": {"at": "0.3 s"}, "duration": "0.05 s"}
    three = case(CAMERA_OUT), case(late), case(CAMERA_OUT)
    assert [active_ticks(*three, ticks=10, run=run) for run in (1, 2)] == [[6], [4, 5, 6]]


def test_condition_begins_a_fault_in_each_run_when_it_first_holds_there() -> None:
    active = activity([case(NOMINAL_SILENT)], 60)
    first = [int(np.argmax(active[:, run, 0])) for run in range(3)]
    for speed, tick in zip((10.0, 15.0, 20.0), first, strict=True):
        before, at = (35.5 - (speed - 8.0) * STEP * when for when in (tick - 1, tick))
        assert before >= 30.0 > at
    assert active[first[0] :, 0, 0].all()


def test_condition_may_use_a_parameter_of_the_scenario() -> None:
    fault = {**NOMINAL_SILENT, "onset": {"when": "time >= delay"}}
    cases = [case(fault, delay=delay) for delay in (0.1, 0.2, 9.0)]
    active = activity(cases, 10)
    assert [int(active[:, run, 0].sum()) for run in range(3)] == [8, 6, 0]


def test_intermittent_fault_comes_again_after_it_went() -> None:
    fault = {**CAMERA_OUT, "duration": "0.1 s", "every": "0.25 s"}
    assert active_ticks(case(fault), ticks=20) == [4, 5, 9, 10, 14, 15, 19]
    assert active_ticks(case({**fault, "times": 2}), ticks=20) == [4, 5, 9, 10]


def test_duration_and_repetition_count_from_when_the_condition_held() -> None:
    fault = {**NOMINAL_SILENT, "onset": {"when": "time >= 0.2 s"}}
    assert active_ticks(case({**fault, "duration": "0.1 s"}), ticks=10) == [4, 5]
    again = {**fault, "duration": "0.05 s", "every": "0.3 s"}
    assert active_ticks(case(again), ticks=20) == [4, 10, 16]


def test_random_onset_lies_in_its_window_and_hangs_on_the_situation_alone() -> None:
    fault = {**CAMERA_OUT, "onset": {"between": ["0.2 s", "1.2 s"]}, "duration": None}
    cases = [case(fault, delay=delay) for delay in np.linspace(0.1, 2.0, 3)]
    first = [active_ticks(*cases, ticks=40, run=run)[0] for run in range(3)]
    assert all(4 <= tick <= 24 for tick in first)
    assert len(set(first)) > 1
    assert [active_ticks(one, ticks=40)[0] for one in cases] == first
    other = case({**fault, "id": "another"}, delay=0.1)
    assert active_ticks(other, ticks=40)[0] != first[0]


def test_ended_run_has_no_active_fault() -> None:
    plan = FaultPlan([case(CAMERA_OUT)] * 3, CONTEXT)
    scene = scene_of(CONTEXT, 5)
    scene.running[1] = False
    assert plan.update(scene)[:, 0].tolist() == [True, False, True]


@settings(max_examples=25)
@given(
    at=st.floats(0.0, 2.0),
    duration=st.sampled_from(["0 s", None]),
    model=st.sampled_from([CAMERA_OUT, NOMINAL_SILENT]),
)
def test_fault_of_no_time_is_identity(
    at: float, duration: str | None, model: dict[str, Any]
) -> None:
    onset = at if duration == "0 s" else at + 2.0
    fault = {**model, "onset": {"at": f"{onset} s"}, "duration": duration}
    plan = FaultPlan([case(fault)] * 3, CONTEXT)
    for scene in scenes(40):
        active = plan.update(scene)
        front, nominal = reading(scene.time), command("nominal", scene.time)
        assert not active.any()
        assert plan.on_readings({"front": front}, active, scene)["front"] is front
        assert plan.on_commands([nominal], active, scene)[0] is nominal


def test_only_the_target_is_touched() -> None:
    plan = FaultPlan([case(CAMERA_OUT, NOMINAL_SILENT)] * 3, CONTEXT)
    active, here = np.ones((3, 2), dtype=np.bool_), scene_of(CONTEXT, 0)
    rear, safety = reading(1.0), command("safety", 1.0)
    readings = plan.on_readings({"front": reading(1.0), "rear": rear}, active, here)
    commands = plan.on_commands([command("nominal", 1.0), safety], active, here)
    assert readings["rear"] is rear
    assert not readings["front"].alive.any()
    assert commands[1] is safety
    assert commands[0].status.tolist() == [SILENT] * 3


def test_removed_fault_returns_the_signal_and_two_of_one_target_are_one_outage() -> None:
    other = {**CAMERA_OUT, "id": "again", "onset": {"at": "0.3 s"}}
    for faults, sound in (((CAMERA_OUT,), [7, 8, 9]), ((CAMERA_OUT, other), [9])):
        plan = FaultPlan([case(*faults)] * 3, CONTEXT)
        for scene in scenes(10):
            given = reading(scene.time)
            found = plan.on_readings({"front": given}, plan.update(scene), scene)["front"]
            is_sound = scene.tick in [0, 1, 2, 3, *sound]
            assert (found is given) == bool(found.alive.all()) == is_sound, scene.tick


def test_unknown_target_and_different_faults_in_one_batch_are_refused() -> None:
    with pytest.raises(SpecError, match=r"no sensors\.side"):
        FaultPlan([case({**CAMERA_OUT, "target": "sensors.side"})] * 3, CONTEXT)
    with pytest.raises(SpecError, match="different faults"):
        FaultPlan([case(CAMERA_OUT), case(CAMERA_OUT), case()], CONTEXT)


def test_only_the_channel_behind_the_link_is_shown_something_else() -> None:
    lost = fault("lost", "links.nominal.front", "drop")
    plan = FaultPlan([case(lost)] * 3, CONTEXT)
    scene = scene_of(CONTEXT, 1)
    active = plan.update(scene)
    view = View({"front": reading(1.0), "rear": reading(1.0)}, {}, None)
    assert plan.on_links(active, scene, "safety", view) is view
    seen = plan.on_links(active, scene, "nominal", view)
    assert seen.measurements["rear"] is view.measurements["rear"]
    assert seen.measurements["front"].stamp.tolist() == [-1.0] * 3
    assert view.measurements["front"].stamp.tolist() == [1.0] * 3


# --- What an injector is told: which runs, and how long ago the fault began in each ---------------


def test_injector_is_told_when_its_fault_began_in_each_run(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[Moment] = []

    class Probe:
        def __init__(self, context: InjectorContext) -> None:
            assert len(context.specs) == 3

        def apply(self, thing: Any, moment: Moment) -> Any:
            told.append(moment)
            return thing

    monkeypatch.setattr(schedule, "INJECTORS", {("sensors", "drop_out"): Probe})
    late = {**CAMERA_OUT, "onset": {"at": "0.3 s"}, "duration": None}
    plan = FaultPlan([case(CAMERA_OUT), case(late), case(late)], CONTEXT)
    for tick in range(10):
        scene = scene_of(CONTEXT, tick)
        plan.on_readings({"front": reading(scene.time)}, plan.update(scene), scene)
    assert np.isnan(told[3].age).all()
    assert told[4].age.tolist() == pytest.approx([0.0, np.nan, np.nan], nan_ok=True)
    assert told[9].age.tolist() == pytest.approx([0.25, 0.15, 0.15])
    assert told[9].active.tolist() == [False, True, True]
    assert told[9].time == pytest.approx(0.45)
