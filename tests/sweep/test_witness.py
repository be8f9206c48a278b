"""Feasible combinations of bins, against an even grid that shares no code with the search."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.spec.load import load_scenario, shipped
from adeye.spec.odd import Attributes, CoverageBins
from adeye.spec.quantity import SI
from adeye.spec.scenario import LogicalScenario
from adeye.sweep.coverage import Bins, Witnesses, bins_of, tuples_of

if TYPE_CHECKING:
    from collections.abc import Callable


SPEEDS = [0.0, 60.0, 100.0, 130.0]
FRICTIONS = [0.0, 0.5, 0.8, 1.2]


def cut_in() -> LogicalScenario:
    return load_scenario(shipped("scenarios_db") / "motorway" / "cut_in.yaml").spec


def bins() -> Bins:
    content: dict[str, Any] = {
        "ego_speed": [f"{edge} km/h" for edge in SPEEDS],
        "friction": FRICTIONS,
    }
    every = bins_of(Attributes(), CoverageBins.model_validate(content))
    return {name: every[name] for name in content}


def limited(scenario: LogicalScenario, *constraints: str) -> LogicalScenario:
    content = scenario.model_dump(mode="json")
    return LogicalScenario.model_validate({**content, "constraints": list(constraints)}, context=SI)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("constraint", "holds"),
    [
        ("ego_speed >= 0 km/h", lambda _speed, _friction: True),
        ("ego_speed <= 90 km/h or friction >= 0.6", lambda v, f: v <= 90 or f >= 0.6),
        ("ego_speed / 100 km/h <= friction", lambda v, f: v / 100 <= f),
        ("ego_speed > 129.9 km/h or friction > 0.81", lambda v, f: v > 129.9 or f > 0.81),
    ],
)
def test_feasible_pairs_are_those_that_a_fine_grid_has(
    constraint: str,
    holds: Callable[[float, float], bool],
) -> None:
    scenario = limited(cut_in(), constraint)
    found = Witnesses([scenario], bins(), 2).found
    # The cut-in has ego_speed from 20 to 130 km/h and friction from 0.3 to 1.
    expected = set()
    for speed, friction in itertools.product(
        np.linspace(20, 130, 2201), np.linspace(0.3, 1.0, 141)
    ):
        if holds(speed, friction):
            at = min(np.searchsorted(SPEEDS, speed, side="right") - 1, 2)
            of = min(np.searchsorted(FRICTIONS, friction + 1e-12, side="right") - 1, 2)
            expected.add((("ego_speed", "friction"), (int(at), int(of))))
    assert found == expected


def test_no_point_that_fulfils_the_constraints_means_nothing_is_feasible() -> None:
    scenario = limited(cut_in(), "friction > 2")
    assert Witnesses([scenario], bins(), 1).found == set()


def test_scenarios_add_up() -> None:
    slow = limited(cut_in(), "ego_speed < 50 km/h")
    fast = limited(cut_in(), "ego_speed > 110 km/h")
    both = Witnesses([slow, fast], bins(), 2).found
    assert both == Witnesses([slow], bins(), 2).found | Witnesses([fast], bins(), 2).found


def test_combination_with_a_missing_bin_counts_nowhere() -> None:
    codes = {"a": np.array([0, 0, -1]), "b": np.array([1, 1, 1]), "c": np.array([-1, 0, 0])}
    assert tuples_of(codes, 2) == {
        (("a", "b"), (0, 1)): 2,
        (("a", "c"), (0, 0)): 1,
        (("b", "c"), (1, 0)): 2,
    }


def test_attribute_with_several_values_counts_for_each_of_them() -> None:
    codes = {"a": np.array([0, 1]), "b": np.array([[0, 0], [2, -1]])}
    assert tuples_of(codes, 1) == {
        (("a",), (0,)): 1,
        (("a",), (1,)): 1,
        (("b",), (0,)): 2,
        (("b",), (2,)): 1,
    }
    assert tuples_of(codes, 2) == {
        (("a", "b"), (0, 0)): 1,
        (("a", "b"), (0, 2)): 1,
        (("a", "b"), (1, 0)): 1,
    }
