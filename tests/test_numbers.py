"""A campaign comes to the numbers that are written down, on whatever machine it is executed."""

from __future__ import annotations

from typing import Any

import pytest

from tests.numbers import TABLE, numbers_of
from tests.project import Executed, rows_of
from tests.stored import read_yaml


@pytest.fixture(scope="module")
def found(mini: Executed) -> dict[str, dict[str, str]]:
    with mini.opened() as (repository, info):
        return numbers_of(rows_of(repository, info.id))


@pytest.mark.parametrize("part", ["traces", "outcomes", "metrics"])
def test_mini_campaign_comes_to_what_is_written_down(
    found: dict[str, dict[str, Any]], part: str
) -> None:
    assert found[part] == read_yaml(TABLE)[part], "if it is meant: python -m tests.numbers"
