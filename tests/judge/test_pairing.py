"""Pairs of results: joins, tables of verdicts, groups."""

from __future__ import annotations

import math

import numpy as np

from adeye.judge.evaluate import ERROR, FAIL, INCONCLUSIVE, INVALID, PASS, VACUOUS
from adeye.judge.pairing import (
    FAILED,
    HELD,
    NOT_JUDGED,
    NOT_RUN,
    UNDECIDED,
    Groups,
    counts_of,
    number_rows,
    pair_up,
    severities,
    verdict_table,
)


def test_rows_meet_by_key_whatever_their_order() -> None:
    first, second = pair_up(np.array([7, 3, 9, 5]), np.array([5, 7, 1, 3]))
    assert list(zip(first.tolist(), second.tolist(), strict=True)) == [(0, 1), (1, 3), (3, 0)]


def test_row_with_several_partners_is_in_several_pairs() -> None:
    first, second = pair_up(np.array([1, 2]), np.array([2, 1, 1]))
    assert list(zip(first.tolist(), second.tolist(), strict=True)) == [(0, 1), (0, 2), (1, 0)]


def test_nobody_meets_nobody() -> None:
    first, second = pair_up(np.array([1]), np.zeros(0, dtype=np.int64))
    assert (len(first), len(second)) == (0, 0)


def test_rows_get_one_number_exactly_where_all_columns_agree() -> None:
    codes = number_rows(np.array([1, 1, 2, 1]), np.array([5, 6, 5, 5]), np.array([-1, -1, -1, -1]))
    assert codes[0] == codes[3]
    assert len(set(codes.tolist())) == 3


def test_only_fail_fails_and_only_pass_and_vacuous_hold() -> None:
    codes = np.array([PASS, FAIL, INCONCLUSIVE, VACUOUS, INVALID, ERROR, NOT_RUN, NOT_JUDGED])
    assert severities(codes).tolist() == [
        HELD, FAILED, UNDECIDED, HELD, UNDECIDED, UNDECIDED, UNDECIDED, NOT_JUDGED,
    ]  # fmt: skip


def test_every_pair_is_counted_once() -> None:
    codes = np.arange(-1, NOT_RUN + 1)
    a, b = (item.ravel() for item in np.meshgrid(codes, codes))
    counts = counts_of(verdict_table(a, b))
    # Seven verdicts each; what is not judged is no pair.
    assert counts.pairs == 49
    assert (counts.both_pass, counts.only_a_fails, counts.only_b_fails, counts.both_fail) == (
        1, 2, 2, 1,
    )  # fmt: skip
    assert (counts.neutral, counts.undecided) == (3, 40)


def test_vacuous_is_no_pass() -> None:
    counts = counts_of(verdict_table(np.array([VACUOUS, PASS]), np.array([PASS, VACUOUS])))
    assert (counts.both_pass, counts.neutral) == (0, 2)


def test_groups_keep_the_worst_and_the_mean_of_what_there_is() -> None:
    groups = Groups.of(np.array([5, 3, 5, 3]))
    assert groups.keys.tolist() == [3, 5]
    severity = np.array([[HELD], [UNDECIDED], [FAILED], [HELD]])
    assert groups.worst(severity).tolist() == [[UNDECIDED], [FAILED]]
    mean = groups.mean(np.array([1.0, math.nan, 4.0, math.nan]))
    assert math.isnan(mean[0])
    assert mean[1] == 2.5
