"""Test cases by ordinal: a sequence like a list, made chunk by chunk."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from adeye.sweep import expand as sequence
from adeye.sweep.expand import Expansion, LazyCases, expand

if TYPE_CHECKING:
    from adeye.spec.load import OddFiles

Load = Callable[..., "OddFiles"]


@pytest.fixture
def expansion(load: Load) -> Expansion:
    return expand(load(replicates=5))


def test_it_is_the_list_of_the_test_cases(expansion: Expansion) -> None:
    cases, whole = LazyCases(expansion), list(expansion.cases())
    assert len(cases) == len(whole) == 60
    assert [cases[ordinal] for ordinal in range(60)] == whole == list(cases)
    assert cases[-1] == whole[-1]
    assert cases[7:31:3] == whole[7:31:3]
    assert cases[58:99] == whole[58:]


def test_ordinal_that_is_not_there_is_an_index_error(expansion: Expansion) -> None:
    cases = LazyCases(expansion)
    for wrong in (60, -61):
        with pytest.raises(IndexError, match=f"test case {wrong} of 60"):
            cases[wrong]


def test_block_is_made_once_whatever_the_order(
    expansion: Expansion, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sequence, "CHUNK", 8)
    made: list[tuple[int, int]] = []
    original = Expansion.cases

    def counted(self: Expansion, start: int = 0, stop: int | None = None) -> Any:
        made.append((start, stop or 0))
        return original(self, start, stop)

    monkeypatch.setattr(Expansion, "cases", counted)
    cases = LazyCases(expansion)
    for ordinal in (40, 47, 44, 41, 48, 46, 49):
        assert cases[ordinal].replicate == ordinal % 5
    assert made == [(40, 48), (48, 56)]


def test_only_some_chunks_are_kept(expansion: Expansion, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sequence, "CHUNK", 2)
    cases = LazyCases(expansion)
    first = cases[0]
    assert cases[0] is first
    for ordinal in range(2, 2 + 2 * sequence.KEPT_CHUNKS):
        cases[ordinal]
    assert cases[0] is not first
    assert cases[0] == first
