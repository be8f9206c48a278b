"""Blocks cover every ordinal once and cross no end of a structure."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.store.write.planning import block_bounds


def test_blocks_end_where_structures_do() -> None:
    assert list(block_bounds([3, 8], 4)) == [(0, 3), (3, 7), (7, 8)]


@given(steps=st.lists(st.integers(1, 30), min_size=1, max_size=8), size=st.integers(1, 12))
def test_blocks_cover_every_ordinal_once(steps: list[int], size: int) -> None:
    ends = [sum(steps[: at + 1]) for at in range(len(steps))]
    blocks = list(block_bounds(ends, size))
    assert [at for first, end in blocks for at in range(first, end)] == list(range(ends[-1]))
    assert all(end - first <= size for first, end in blocks)
    assert {end for _, end in blocks} >= set(ends)


def test_block_has_at_least_one_ordinal() -> None:
    with pytest.raises(ValueError, match="block_size is 0"):
        list(block_bounds([3], 0))
