"""Identity of a test case: what changes the drive changes the digest, and nothing else does."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from adeye.spec.odd import Attributes
from adeye.sweep.case import AuthorityOverride, TestCase, content_digest
from adeye.sweep.expand import expand

if TYPE_CHECKING:
    from collections.abc import Callable

    from adeye.spec.load import OddFiles

FAULT = {
    "id": "camera_out",
    "target": "sensors.front_camera",
    "model": "drop_out",
    "onset": {"at": "2 s"},
}


@pytest.fixture
def case(load: Callable[..., OddFiles]) -> TestCase:
    """Return the last test case of a small plan: camera and radar, with a fault."""
    return list(expand(load(faults=[FAULT])).cases())[-1]


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
