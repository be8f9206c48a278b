"""Sections: what one file variant makes alike stands together, and every ordinal is in one."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from adeye.sweep.expand import Expansion, expand
from adeye.sweep.groups import overlapping

if TYPE_CHECKING:
    from adeye.spec.load import OddFiles

Load = Callable[..., "OddFiles"]

RANGE = "architecture.sensors.front_camera.range"
TAIL = "scenario.tail"
GAPS = ["30 m", "40 m", "50 m"]


def expanded(load: Load, **parameters: list[Any]) -> Expansion:
    odd = {"architectures": ["architectures/camera_radar.yaml"], "replicates": 2}
    return expand(load({"parameters": parameters}, **odd))


def test_axes_of_parameters_make_one_section(load: Load) -> None:
    sections = expanded(load, gap=GAPS, rain=["0 mm/h", "5 mm/h"]).sections
    assert [(item.first, item.end, len(item)) for item in sections] == [(0, 12, 12)]
    assert sections[0].rows.tolist() == [0, 1, 2, 3, 4, 5]


def test_points_of_one_variant_stand_together(load: Load) -> None:
    sections = expanded(load, **{"gap": GAPS, TAIL: ["10 s", "13 s"]}).sections
    assert [item.rows.tolist() for item in sections] == [[0, 2, 4], [1, 3, 5]]
    assert [(item.first, item.end) for item in sections] == [(0, 6), (6, 12)]


def test_sections_stand_in_the_order_of_their_first_points(load: Load) -> None:
    sweep = {
        "design": "zip",
        "parameters": {
            "gap": ["30 m", "40 m", "50 m", "60 m"],
            RANGE: ["120 m", "90 m", "90 m", "120 m"],
        },
    }
    sections = expand(load(sweep, architectures=["architectures/camera_radar.yaml"])).sections
    assert [item.rows.tolist() for item in sections] == [[0, 3], [1, 2]]


def test_what_is_written_differently_is_another_section(load: Load) -> None:
    cost = [1, 2]
    assert len(expanded(load, **{"architecture.cost": cost}).sections) == 2


@pytest.mark.parametrize(
    ("start", "stop", "found"),
    [
        (0, 12, [(0, 0, 6), (6, 0, 6)]),
        (5, 7, [(0, 5, 6), (6, 0, 1)]),
        (6, 7, [(6, 0, 1)]),
        (11, 99, [(6, 5, 6)]),
        (4, 4, []),
        (12, 13, []),
    ],
)
def test_ordinal_range_is_found_in_its_sections(
    load: Load, start: int, stop: int, found: list[tuple[int, int, int]]
) -> None:
    sections = expanded(load, **{"gap": GAPS, TAIL: ["10 s", "13 s"]}).sections
    got = [(item.first, low, high) for item, low, high in overlapping(sections, start, stop)]
    assert got == found
