"""A column of statuses: words to read, codes to calculate with."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.judge.metrics.registry import CODES, STATUSES, StatusColumn, status_codes


def test_column_reads_as_its_words() -> None:
    column = StatusColumn(np.array([0, 5, 2]))
    assert tuple(column) == ("value", "error", "not_applicable")
    assert (column[1], tuple(column[1:]), len(column)) == ("error", tuple(column)[1:], 3)
    assert column == ("value", "error", "not_applicable")
    assert column != ("value", "error", "error")
    assert hash(column) == hash(tuple(column))
    assert repr(column) == repr(tuple(column))


@pytest.mark.parametrize("words", [STATUSES, StatusColumn(np.arange(6))])
def test_codes_are_those_of_the_words(words: tuple[str, ...]) -> None:
    assert status_codes(words).tolist() == [CODES[word] for word in STATUSES] == list(range(6))


def test_other_words_have_no_code() -> None:
    assert status_codes(("fine", "value")).tolist() == [-1, 0]
