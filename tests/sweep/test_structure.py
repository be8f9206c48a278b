"""Batches: one structure inside, only values vary, the order is the plan's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.sweep import case as structure
from adeye.sweep.case import batches, structure_key
from adeye.sweep.expand import expand

if TYPE_CHECKING:
    from adeye.spec.load import OddFiles
    from adeye.sweep.case import TestCase

Load = Callable[..., "OddFiles"]
CAMERA_OUT: dict[str, Any] = {
    "id": "camera_out",
    "target": "sensors.front_camera",
    "model": "drop_out",
    "onset": {"at": "2 s"},
}


def keys(files: OddFiles) -> list[str]:
    """Return the different structures of a plan, in order."""
    return list(dict.fromkeys(structure_key(case) for case in expand(files).cases()))


def only(axis: str, *values: Any) -> dict[str, Any]:
    return {"parameters": {axis: list(values)}}


CANDIDATE = ["architectures/camera_radar.yaml"]


@pytest.mark.parametrize(
    "sweep",
    [
        only("gap", "30 m", "60 m"),
        only("architecture.sensors.front_camera.range", "80 m", "120 m"),
        only("architecture.sensors.front_camera.mount.yaw", "0 deg", "2 deg"),
        only("architecture.vehicle.mass", 1500, 2000),
        only("architecture.channels.nominal.parameters.time_gap", "1.5 s", "2 s"),
        only("scenario.environment.illumination", "day", "night"),
    ],
)
def test_values_vary_inside_a_batch(load: Load, sweep: dict[str, Any]) -> None:
    assert len(keys(load(sweep, architectures=CANDIDATE))) == 1


@pytest.mark.parametrize(
    "sweep",
    [
        only("architecture.sensors.front_camera.rate", "10 Hz", "20 Hz"),
        only("architecture.sensors.front_camera.latency", "0.1 s", "0.2 s"),
        only("architecture.channels.nominal.delay", "0 s", "0.05 s"),
        only("architecture.switch.policy", "fixed_priority", "stuck"),
        only("architecture.switch.default", "nominal", "safety"),
        {"parameters": {"architecture.switch.latch": [True, False]}},
        only("architecture.switch.priority", ["safety", "nominal"], ["nominal", "safety"]),
        only("architecture.channels.nominal.links", ["localisation"], []),
        only("scenario.world.road.lanes", 2, 3),
        only("scenario.horizon", "5 s", "6 s"),
        only("scenario.actors.cutter.kind", "car", "truck"),
    ],
)
def test_structure_parts_batches(load: Load, sweep: dict[str, Any]) -> None:
    assert len(keys(load(sweep, architectures=CANDIDATE))) == 2


def test_architecture_fault_entry_and_step_part_batches(load: Load) -> None:
    assert len(keys(load(faults=[CAMERA_OUT]))) == 4
    case = next(iter(expand(load()).cases()))
    assert structure_key(replace(case, step=0.025)) != structure_key(case)
    assert structure_key(replace(case, replicate=3)) == structure_key(case)


def test_onset_time_varies_inside_a_batch_and_its_condition_does_not(load: Load) -> None:
    path = "faults.camera_out.onset.at"
    files = load(only(path, "1 s", "2 s"), faults=[CAMERA_OUT], architectures=CANDIDATE)
    assert len(keys(files)) == 2  # without and with the fault
    path = "faults.camera_out.onset.when"
    triggered = {**CAMERA_OUT, "onset": {"when": "time > 1 s"}}
    files = load(
        only(path, "time > 1 s", "time > 2 s"), faults=[triggered], architectures=CANDIDATE
    )
    assert len(keys(files)) == 3


def test_batches_are_the_plan_in_its_order_with_one_structure_each(load: Load) -> None:
    cases = list(expand(load(faults=[CAMERA_OUT])).cases())
    for size in (1, 4, 6, 1_000):
        cut = list(batches(cases, size))
        assert [case for batch in cut for case in batch] == cases
        assert all(len(batch) <= size for batch in cut)
        assert all(len({structure_key(case) for case in batch}) == 1 for batch in cut)
    assert [len(batch) for batch in batches(cases, 4)] == [4, 2] * 4


@given(letters=st.text("ab", max_size=30), size=st.integers(1, 7))
def test_batches_are_as_few_as_order_and_size_allow(letters: str, size: int) -> None:
    class Case:
        def __init__(self, key: str) -> None:
            self.key = key

    cases: Any = [Case(letter) for letter in letters]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(structure, "structure_key", lambda case: case.key)
        cut: list[list[Any]] = [list(batch) for batch in batches(cases, size)]
    runs: list[list[str]] = []
    for letter in letters:
        if runs and runs[-1][0] == letter and len(runs[-1]) < size:
            runs[-1].append(letter)
        else:
            runs.append([letter])
    assert [[case.key for case in batch] for batch in cut] == runs


def test_nothing_makes_no_batch() -> None:
    none: list[TestCase] = []
    assert list(batches(none, 5)) == []
