"""Test cases: identity, columns, structure, and which stand in one batch."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.errors import SweepError
from adeye.spec.load import OddFiles, load_odd
from adeye.spec.odd import Attributes
from adeye.store.texts import json_text
from adeye.sweep import case as structure
from adeye.sweep.case import AuthorityOverride, TestCase, batches, content_digest, structure_key
from adeye.sweep.expand import Expansion, expand
from tests.refusals import refused
from tests.sweep.conftest import CAMERA_OUT, CANDIDATE, Load

# --- Identity of a test case: what changes the drive changes the digest, and nothing else does ----


@pytest.fixture
def case(load: Load) -> TestCase:
    """Return the last test case of a small plan: camera and radar, with a fault."""
    return list(expand(load(faults=[CAMERA_OUT])).cases())[-1]


def changed(case: TestCase, part: str, **changes: Any) -> TestCase:
    """Change a record of a test case."""
    return replace(case, **{part: getattr(case, part).model_copy(update=changes)})


def test_digests_are_sha256(case: TestCase) -> None:
    for found in (case.digest, case.situation_digest):
        assert len(found) == 64
        assert int(found, 16)
    assert case.digest != case.situation_digest
    assert 0 <= case.stream_seed < 2**64


def test_situation_is_scenario_parameters_replicate_and_seed(case: TestCase) -> None:
    for other in (
        replace(case, replicate=case.replicate + 1),
        replace(case, seed=case.seed + 1),
        replace(case, parameters={**case.parameters, "gap": 31.0}),
        changed(case, "scenario", realised=()),
    ):
        assert other.situation_digest != case.situation_digest
        assert other.digest != case.digest


def test_stream_does_not_depend_on_the_rest_of_the_scenario(case: TestCase) -> None:
    for other in (
        changed(case, "scenario", horizon=99.0),
        replace(case, step=0.025),
        replace(case, faults=(), fault_entry="none"),
        replace(case, scenario_id="another_use"),
        replace(case, inside_odd=False),
    ):
        assert other.stream_seed == case.stream_seed
    assert replace(case, replicate=1).stream_seed != case.stream_seed
    assert replace(case, seed=1).stream_seed != case.stream_seed
    other_gap = replace(case, parameters={**case.parameters, "gap": 31.0})
    assert other_gap.stream_seed != case.stream_seed


def test_test_case_adds_clock_horizon_architecture_and_faults(case: TestCase) -> None:
    vehicle = case.architecture.vehicle.model_copy(update={"mass": 1801.0})
    longer = case.faults[0].model_copy(update={"duration": 9.0})
    for other in (
        replace(case, step=0.025),
        changed(case, "scenario", tail=99.0),
        changed(case, "architecture", vehicle=vehicle),
        replace(case, faults=()),
        replace(case, faults=(longer,)),
    ):
        assert other.digest != case.digest
    assert replace(case, step=0.025).situation_digest == case.situation_digest


def test_names_points_and_attributes_are_no_identity(case: TestCase) -> None:
    for other in (
        replace(case, scenario_id="another_use"),
        replace(case, fault_entry="another"),
        replace(case, point={}),
        replace(case, inside_odd=not case.inside_odd),
        replace(case, attributes=Attributes()),
        changed(case, "architecture", title="Another", architecture="another", cost=9.0),
        changed(case, "scenario", title="Another"),
        replace(case, faults=(case.faults[0].model_copy(update={"text": "words"}),)),
    ):
        assert other.digest == case.digest


def test_order_of_parameters_is_no_identity(case: TestCase) -> None:
    turned = dict(reversed(list(case.parameters.items())))
    assert replace(case, parameters=turned).digest == case.digest


def test_content_digest_is_of_the_content_not_of_the_record(case: TestCase) -> None:
    copy = case.architecture.model_copy(deep=True)
    assert copy is not case.architecture
    assert content_digest(copy) == content_digest(case.architecture)
    assert content_digest(case.scenario) != content_digest(case.architecture)


def test_override_is_identity_and_leaves_the_situation(case: TestCase) -> None:
    others = [
        replace(case, override=AuthorityOverride(tick, channel))
        for tick, channel in ((0, "nominal"), (0, "safety"), (40, "safety"))
    ]
    assert len({case.digest, *(other.digest for other in others)}) == 4
    assert {other.situation_digest for other in others} == {case.situation_digest}
    assert {other.stream_seed for other in others} == {case.stream_seed}


# --- Columns say of every test case what its record says: one definition of identity --------------


ROOT = Path(__file__).parents[2]
SHIPPED = [path for path in sorted((ROOT / "odd").glob("*.yaml")) if path.stem != "million"]


def alone(case: TestCase) -> TestCase:
    """The test case without anything that was computed for many."""
    return replace(case, replicate=case.replicate)


def check(expansion: Expansion, start: int = 0, stop: int | None = None) -> None:
    for columns in expansion.columns(start, stop, 100):
        cases = [alone(case) for case in columns.cases()]
        assert columns.situation_digest == [case.situation_digest for case in cases]
        assert columns.digest == [case.digest for case in cases]
        assert columns.stream_seed == [case.stream_seed for case in cases]
        assert columns.replicate == [case.replicate for case in cases]
        assert columns.inside_odd == [case.inside_odd for case in cases]
        assert columns.parameters_json == [json_text(dict(case.parameters)) for case in cases]
        assert columns.point_json == [json_text(dict(case.point)) for case in cases]


@pytest.mark.slow
@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_every_test_case_of_the_shipped_odds_has_the_identity_of_its_row(path: Path) -> None:
    check(expand(load_odd(path)))


def test_some_of_a_million_have_the_identity_of_their_rows() -> None:
    expansion = expand(load_odd(ROOT / "odd" / "million.yaml"))
    for start in range(7, expansion.count, 99_991):
        check(expansion, start, start + 50)


def test_overrides_replicates_and_faults_are_in_the_identity(load: Load) -> None:
    parameters: dict[str, list[Any]] = {
        "gap": ["30 m", "45 m"],
        "architecture.sensors.front_camera.range": ["90 m", "120 m"],
        "scenario.ego.speed": ["ego_speed", "ego_speed - 1 m/s"],
        "faults.camera_out.onset.at": ["1 s", "2 s"],
    }
    expansion = expand(load({"parameters": parameters}, faults=[CAMERA_OUT], replicates=3))
    assert expansion.count == 2 * (8 + 16) * 3
    check(expansion)


def test_random_points_are_written_so_that_they_read_back(load: Load) -> None:
    axes = {"gap": ["30 m", "60 m"], "ego_speed": ["60 km/h", "130 km/h"]}
    sweep = {"design": "random", "samples": 50, "parameters": axes}
    expansion = expand(load(sweep, replicates=2))
    check(expansion)
    columns = next(expansion.columns(0, 50))
    written = [json.loads(text) for text in columns.point_json]
    assert written == [dict(case.point) for case in columns.cases()]


def test_design_without_axes_has_one_point_per_replicate(load: Load) -> None:
    expansion = expand(load({}, replicates=5))
    check(expansion)
    assert next(expansion.columns()).point_json == ["{}"] * 5


def test_size_of_the_columns_changes_nothing(load: Load) -> None:
    expansion = expand(load(faults=[CAMERA_OUT], replicates=3))
    whole = [item for columns in expansion.columns() for item in columns.digest]
    for size in (1, 2, 7):
        assert [i for part in expansion.columns(size=size) for i in part.digest] == whole
    assert [i for part in expansion.columns(20, 41, 4) for i in part.digest] == whole[20:41]


def test_worlds_are_those_of_the_points(load: Load) -> None:
    columns = next(expand(load(replicates=2)).columns())
    worlds = columns.worlds()
    assert [world.parameters for world in worlds] == [c.parameters for c in columns.cases()[::2]]


def test_the_first_point_outside_is_told_wherever_one_begins(load: Load) -> None:
    sweep = {"parameters": {"ego_speed": ["80 km/h", "125 km/h", "110 km/h"]}}
    limits = {"dynamic_elements": {"ego_speed": {"max": "100 km/h"}}}
    expansion = expand(load(sweep, attributes=limits))
    next(expansion.columns(0, 1))
    refused(SweepError, next, expansion.columns(2, 3), says="ego_speed: 110 km/h is above")


# --- Batches: one structure inside, only values vary, the order is the plan's ---------------------


def keys(files: OddFiles) -> list[str]:
    """Return the different structures of a plan, in order."""
    return list(dict.fromkeys(structure_key(case) for case in expand(files).cases()))


PARTING = [
    ("architecture.sensors.front_camera.rate", ["10 Hz", "20 Hz"]),
    ("architecture.sensors.front_camera.latency", ["0.1 s", "0.2 s"]),
    ("architecture.channels.nominal.delay", ["0 s", "0.05 s"]),
    ("architecture.switch.policy", ["fixed_priority", "stuck"]),
    ("architecture.switch.default", ["nominal", "safety"]),
    ("architecture.switch.latch", [True, False]),
    ("architecture.switch.priority", [["safety", "nominal"], ["nominal", "safety"]]),
    ("architecture.channels.nominal.links", [["localisation"], []]),
    ("scenario.world.road.lanes", [2, 3]),
    ("scenario.actors.cutter.kind", ["car", "truck"]),
]
VARYING = [
    ("gap", ["30 m", "60 m"]),
    ("architecture.sensors.front_camera.range", ["80 m", "120 m"]),
    ("architecture.sensors.front_camera.mount.yaw", ["0 deg", "2 deg"]),
    ("architecture.vehicle.mass", [1500, 2000]),
    ("architecture.channels.nominal.parameters.time_gap", ["1.5 s", "2 s"]),
    ("scenario.environment.illumination", ["day", "night"]),
]


def test_structure_parts_batches_and_values_vary_inside_one(load: Load) -> None:
    for count, axes in ((1, VARYING), (2, PARTING)):
        for axis, values in axes:
            files = load({"parameters": {axis: values}}, architectures=CANDIDATE)
            assert len(keys(files)) == count, axis


def test_architecture_fault_entry_and_step_part_batches(load: Load) -> None:
    assert len(keys(load(faults=[CAMERA_OUT]))) == 4
    case = next(iter(expand(load()).cases()))
    assert structure_key(replace(case, step=0.025)) != structure_key(case)
    longer = changed(case, "scenario", horizon=case.scenario.horizon + 1.0)
    assert structure_key(longer) != structure_key(case)
    assert structure_key(replace(case, replicate=3)) == structure_key(case)


def test_onset_time_varies_inside_a_batch_and_its_condition_does_not(load: Load) -> None:
    triggered = {**CAMERA_OUT, "onset": {"when": "time > 1 s"}}
    # One more structure is that without the fault.
    for name, fault, values, count in (
        ("at", CAMERA_OUT, ["1 s", "2 s"], 2),
        ("when", triggered, ["time > 1 s", "time > 2 s"], 3),
    ):
        sweep = {"parameters": {f"faults.camera_out.onset.{name}": values}}
        assert len(keys(load(sweep, faults=[fault], architectures=CANDIDATE))) == count


def test_batches_are_the_plan_in_its_order_with_one_structure_each(load: Load) -> None:
    cases = list(expand(load(faults=[CAMERA_OUT])).cases())
    for size in (1, 4, 6, 1_000):
        cut = list(batches(cases, size))
        assert [case for batch in cut for case in batch] == cases
        assert all(len(batch) <= size for batch in cut)
        assert all(len({structure_key(case) for case in batch}) == 1 for batch in cut)
    assert [len(batch) for batch in batches(cases, 4)] == [4, 2] * 4
    assert list(batches(cases[:0], 5)) == []


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
