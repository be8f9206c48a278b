"""Columns say of every test case what its record says: one definition of identity."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from adeye.errors import SweepError
from adeye.spec.load import load_odd
from adeye.store.encoding import json_text
from adeye.sweep.expand import Expansion, expand

if TYPE_CHECKING:
    from adeye.spec.load import OddFiles
    from adeye.sweep.case import TestCase

Load = Callable[..., "OddFiles"]

ROOT = Path(__file__).parents[2]
SHIPPED = [path for path in sorted((ROOT / "odd").glob("*.yaml")) if path.stem != "million"]
CAMERA_OUT = {
    "id": "camera_out",
    "target": "sensors.front_camera",
    "model": "drop_out",
    "onset": {"at": "2 s"},
}


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


@pytest.mark.slow
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
    sweep = {
        "design": "random",
        "samples": 50,
        "parameters": {"gap": ["30 m", "60 m"], "ego_speed": ["60 km/h", "130 km/h"]},
    }
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
    with pytest.raises(SweepError, match="ego_speed: 110 km/h is above"):
        next(expansion.columns(2, 3))
