"""Blocks: small plans in small ones, large plans in large ones, as far as memory goes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from adeye.campaign import run as blocks

if TYPE_CHECKING:
    from tests.project import Executed


@pytest.mark.parametrize(
    ("planned", "most", "size"),
    [
        (28, 2_000, 16),
        (1_000, 2_000, 62),
        (65_536, 2_000, 1_024),
        (1_000_000, 640, 640),
        (5, 0, 1),
    ],
)
def test_size_follows_the_plan_and_the_memory(planned: int, most: int, size: int) -> None:
    assert blocks._block_size(planned, most) == size


def test_fewer_fit_where_there_is_less_memory(
    mini: Executed, monkeypatch: pytest.MonkeyPatch
) -> None:
    examples = mini.plan.examples()
    before = blocks.fitting(examples)
    monkeypatch.setattr(blocks, "TRACE_MEMORY", blocks.TRACE_MEMORY // 4)
    assert blocks.fitting(examples) == pytest.approx(before / 4, abs=1)
    assert blocks.block_size(mini.plan) <= max(1, before)
