"""Test cases as columns: one of them says what its record says."""

import json
from typing import Any

import pytest

from adeye.errors import InputError
from adeye.store.block import PlannedCases


def test_one_case_is_a_column_of_one(example: Any) -> None:
    case = example.case(5)
    part = PlannedCases.of(case)
    assert len(part) == 1
    assert (part.test_cases, part.situations) == ((case.test_case,), (case.situation,))
    assert json.loads(part.parameters[0]) == case.parameters
    assert json.loads(part.points[0]) == case.point
    assert part.engine.result_digests(part.test_cases) == [case.result_digest]


@pytest.mark.parametrize("seed", [-1, 2**63])
def test_seed_that_no_database_keeps_is_refused(example: Any, seed: int) -> None:
    part = PlannedCases.of(example.case(0))
    with pytest.raises(InputError, match=f"seed: {seed} is not within"):
        PlannedCases(**{**vars(part), "seed": seed})
