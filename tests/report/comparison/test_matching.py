"""Same test cases: situation, fault entry and the axes that both have."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from adeye.report.comparison.candidates import Matching
from adeye.store.read.bulk import Labels, encode_points


def cases(*rows: tuple[str, int, str, dict[str, float]]) -> Any:
    """Make cases of architecture, situation, fault entry and swept values."""
    return SimpleNamespace(
        architecture=Labels.of(row[0] for row in rows),
        situation=np.array([row[1] for row in rows]),
        fault_entry=Labels.of(row[2] for row in rows),
        scenario=Labels.of("cut_in" for _ in rows),
        axes=encode_points(row[3] for row in rows),
    )


def pairs(matching: Matching, a: str, b: str) -> list[tuple[int, int]]:
    first, second = matching.pairs(a, b)
    return list(zip(first.tolist(), second.tolist(), strict=True))


def test_situation_and_fault_decide() -> None:
    matching = Matching(
        cases(("a", 1, "none", {}), ("a", 1, "out", {}), ("b", 1, "none", {}), ("b", 2, "out", {}))
    )
    assert pairs(matching, "a", "b") == [(0, 2)]


def test_axis_of_both_must_agree() -> None:
    matching = Matching(
        cases(
            ("a", 1, "none", {"yaw": 0.0}),
            ("a", 1, "none", {"yaw": 2.0}),
            ("b", 1, "none", {"yaw": 2.0}),
        )
    )
    assert pairs(matching, "a", "b") == [(1, 2)]


def test_axis_that_only_one_has_leaves_all_its_cases_as_partners() -> None:
    matching = Matching(
        cases(("a", 1, "none", {"yaw": 0.0}), ("a", 1, "none", {"yaw": 2.0}), ("b", 1, "none", {}))
    )
    assert pairs(matching, "a", "b") == [(0, 2), (1, 2)]
    assert pairs(matching, "b", "a") == [(2, 0), (2, 1)]


def test_common_cases_are_those_of_everybody() -> None:
    matching = Matching(
        cases(
            ("a", 1, "none", {}),
            ("a", 2, "none", {}),
            ("b", 2, "none", {}),
            ("b", 1, "none", {}),
            ("c", 2, "none", {}),
        )
    )
    found = {name: rows.tolist() for name, rows in matching.common(("a", "b", "c")).items()}
    assert found == {"a": [1], "b": [2], "c": [4]}


def test_nobody_of_that_name_has_no_cases() -> None:
    matching = Matching(cases(("a", 1, "none", {})))
    assert len(matching.rows("b")) == 0
    assert pairs(matching, "a", "b") == []
