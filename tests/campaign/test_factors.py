"""What is stored of how test cases were counted: axes in words, and what a design looked at."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from adeye.campaign.plan import axes_text, design_counts
from adeye.spec.odd import Odd


def odd(sweep: dict[str, Any]) -> Odd:
    return Odd.model_validate(
        {
            "odd": "test",
            "scenarios": [{"use": "cut_in", "sweep": sweep}],
            "architectures": ["a.yaml"],
            "concept": "c.yaml",
        }
    )


def test_axes_are_written_as_their_levels_steps_or_distributions() -> None:
    levels = {
        "gap": ["10 m", "20 m"],
        "ego_speed": {"from": "80 km/h", "to": "120 km/h", "step": "20 km/h"},
    }
    assert axes_text(odd({"parameters": levels}), "cut_in") == {
        "gap": "10 m, 20 m",
        "ego_speed": "80 km/h to 120 km/h, step 20 km/h",
    }
    drawn = {"design": "random", "samples": 3, "parameters": {"gap": {"uniform": ["10 m", "20 m"]}}}
    assert axes_text(odd(drawn), "cut_in") == {"gap": "uniform from 10 m to 20 m"}


def test_points_of_a_list_are_gathered_by_axis() -> None:
    points = {"design": "list", "points": [{"gap": "10 m"}, {"gap": "20 m", "rain": "0 mm/h"}]}
    assert axes_text(odd(points), "cut_in") == {"gap": "10 m, 20 m", "rain": "0 mm/h"}


@pytest.mark.parametrize(
    ("points", "counts"),
    [
        (SimpleNamespace(drawn=9, count=4, tuples=None), {"drawn": 9, "kept": 4}),
        (
            SimpleNamespace(
                drawn=None,
                count=4,
                tuples=SimpleNamespace(strength=2, total=12, feasible=11),
            ),
            {"strength": 2, "tuples": 12, "feasible_tuples": 11},
        ),
        (SimpleNamespace(drawn=None, count=4, tuples=None), {}),
    ],
)
def test_counts_are_those_of_the_design(points: Any, counts: dict[str, int]) -> None:
    assert design_counts(points) == counts
