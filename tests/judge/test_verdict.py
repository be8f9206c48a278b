"""Folding of verdicts and exit codes, every pair against an order that is spelt out here."""

import itertools

import pytest

from adeye.judge.verdict import (
    ExitCode,
    Outcome,
    Verdict,
    exit_code,
    exit_of_verdict,
    fold_fsrs,
    fold_runs,
    gate_exit,
)
from tests.refusals import refused

# Each row: (verdict of one run, of another, fold over both runs, fold over both FSRs).
PAIRS = """
PASS PASS PASS PASS
PASS FAIL FAIL FAIL
PASS INCONCLUSIVE INCONCLUSIVE INCONCLUSIVE
PASS VACUOUS PASS VACUOUS
PASS INVALID INVALID INVALID
PASS ERROR ERROR ERROR
PASS NOT_RUN NOT_RUN NOT_RUN
FAIL FAIL FAIL FAIL
FAIL INCONCLUSIVE FAIL FAIL
FAIL VACUOUS FAIL FAIL
FAIL INVALID FAIL FAIL
FAIL ERROR FAIL FAIL
FAIL NOT_RUN FAIL FAIL
INCONCLUSIVE INCONCLUSIVE INCONCLUSIVE INCONCLUSIVE
INCONCLUSIVE VACUOUS INCONCLUSIVE INCONCLUSIVE
INCONCLUSIVE INVALID INVALID INVALID
INCONCLUSIVE ERROR ERROR ERROR
INCONCLUSIVE NOT_RUN INCONCLUSIVE INCONCLUSIVE
VACUOUS VACUOUS VACUOUS VACUOUS
VACUOUS INVALID INVALID INVALID
VACUOUS ERROR ERROR ERROR
VACUOUS NOT_RUN NOT_RUN NOT_RUN
INVALID INVALID INVALID INVALID
INVALID ERROR ERROR ERROR
INVALID NOT_RUN INVALID INVALID
ERROR ERROR ERROR ERROR
ERROR NOT_RUN ERROR ERROR
NOT_RUN NOT_RUN NOT_RUN NOT_RUN
"""
TABLE = [tuple(Verdict(word) for word in line.split()) for line in PAIRS.strip().splitlines()]

EXITS = """
0: 0-0
1: 0-1 1-1 1-3
2: 0-2 1-2 2-2 2-3
3: 0-3 3-3
4: 0-4 1-4 2-4 3-4 4-4
5: 0-5 1-5 2-5 3-5 4-5 5-5
130: 0-130 1-130 2-130 3-130 4-130 5-130 130-130 130-143
143: 0-143 1-143 2-143 3-143 4-143 5-143 143-143
"""
EXIT_TABLE = [
    (*map(int, pair.split("-")), int(line.split(":")[0]))
    for line in EXITS.strip().splitlines()
    for pair in line.split()[1:]
]


def test_the_tables_hold_every_pair() -> None:
    pairs = {frozenset(row[:2]) for row in TABLE}
    assert pairs == {
        frozenset(p) for p in itertools.combinations_with_replacement(list(Verdict), 2)
    }
    assert len(TABLE) == 28
    exits = {frozenset(row[:2]) for row in EXIT_TABLE}
    assert exits == {
        frozenset(p) for p in itertools.combinations_with_replacement(list(ExitCode), 2)
    }
    assert len(EXIT_TABLE) == 36


@pytest.mark.parametrize(("first", "second", "over_runs", "over_fsrs"), TABLE)
def test_every_pair_of_verdicts_folds_in_either_order(
    first: Verdict, second: Verdict, over_runs: Verdict, over_fsrs: Verdict
) -> None:
    for pair in ([first, second], [second, first]):
        assert fold_runs(pair) is over_runs
        assert fold_fsrs(pair) is over_fsrs


def test_counts_and_lists_fold_alike() -> None:
    verdicts = [Verdict.PASS, Verdict.VACUOUS, Verdict.PASS]
    assert fold_runs(verdicts) is Verdict.PASS
    assert fold_runs({Verdict.PASS: 2, Verdict.VACUOUS: 1, Verdict.FAIL: 0}) is Verdict.PASS


def test_fewer_exercised_runs_than_asked_are_vacuous() -> None:
    counts = {Verdict.PASS: 2, Verdict.VACUOUS: 10}
    assert fold_runs(counts, min_exercised=2) is Verdict.PASS
    assert fold_runs(counts, min_exercised=3) is Verdict.VACUOUS


def test_no_runs_and_no_fsrs_are_not_run() -> None:
    assert fold_runs([]) is Verdict.NOT_RUN
    assert fold_runs({}) is Verdict.NOT_RUN
    assert fold_fsrs([]) is Verdict.NOT_RUN


def test_a_waived_run_is_set_aside_but_passes_nothing() -> None:
    counts = {Verdict.PASS: 1, Verdict.INVALID: 1}
    assert fold_runs(counts, waived={Verdict.INVALID: 1}) is Verdict.PASS
    assert fold_runs({Verdict.NOT_RUN: 2}, waived={Verdict.NOT_RUN: 2}) is Verdict.VACUOUS
    assert fold_runs({Verdict.NOT_RUN: 2}, waived={Verdict.NOT_RUN: 1}) is Verdict.NOT_RUN


def test_only_open_evidence_can_be_waived() -> None:
    for verdict in (Verdict.FAIL, Verdict.ERROR, Verdict.VACUOUS, Verdict.PASS):
        refused(ValueError, fold_runs, {verdict: 1}, waived={verdict: 1}, says="cannot be waived")


def test_nonsense_counts_are_refused() -> None:
    refused(ValueError, fold_runs, [Verdict.VACUOUS], min_exercised=0, says="no run exercised")
    refused(ValueError, fold_runs, {Verdict.PASS: -1}, says="cannot be -1")
    with pytest.raises(ValueError, match="2 runs waived"):
        fold_runs({Verdict.INVALID: 1}, waived={Verdict.INVALID: 2})
    with pytest.raises(ValueError, match="MAYBE"):
        fold_runs(["MAYBE"])  # type: ignore[list-item]


@pytest.mark.parametrize(("first", "second", "expected"), EXIT_TABLE)
def test_every_pair_of_exit_codes_combines_in_either_order(
    first: int, second: int, expected: int
) -> None:
    assert exit_code([ExitCode(first), ExitCode(second)]) == expected
    assert exit_code([ExitCode(second), ExitCode(first)]) == expected


def test_no_exit_code_is_not_success() -> None:
    assert exit_code([]) == 3


def test_every_exit_code_has_a_meaning_of_its_own() -> None:
    meanings = [code.meaning for code in ExitCode]
    assert all(meanings)
    assert len(set(meanings)) == len(meanings)


def test_only_pass_exits_with_zero() -> None:
    assert {v: int(exit_of_verdict(v)) for v in Verdict} == {
        Verdict.PASS: 0,
        Verdict.FAIL: 1,
        Verdict.INCONCLUSIVE: 3,
        Verdict.VACUOUS: 3,
        Verdict.INVALID: 3,
        Verdict.ERROR: 3,
        Verdict.NOT_RUN: 3,
    }


GREEN = {"a": [Verdict.PASS, Verdict.PASS], "b": [Verdict.PASS]}


def test_the_gate_is_green_only_when_everything_is_there_and_passes() -> None:
    for verdicts, planned, accounted, expected in (
        (GREEN, 4, 4, 0),
        (GREEN, 4, 3, 3),
        (GREEN, 4, 5, 4),
        (GREEN, 0, 0, 3),
        ({}, 4, 4, 3),
        ({"a": [Verdict.PASS], "b": []}, 4, 4, 3),
        ({"a": [Verdict.PASS], "b": [Verdict.PASS, Verdict.FAIL]}, 4, 3, 1),
        ({"a": [Verdict.ERROR], "b": [Verdict.PASS]}, 4, 4, 3),
        ({"a": [Verdict.VACUOUS]}, 1, 1, 3),
    ):
        assert gate_exit(verdicts, planned=planned, accounted=accounted) == expected


def test_a_failing_channel_does_not_prevent_judgement() -> None:
    assert {outcome.value for outcome in Outcome if outcome.is_judged} == {
        "completed",
        "channel_error",
        "channel_timeout",
        "channel_invalid_output",
        "channel_killed",
    }
