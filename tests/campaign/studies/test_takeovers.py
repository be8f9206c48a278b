"""Takeovers of a campaign in hindsight, over the mini campaign."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import pytest

from adeye.campaign.studies import forks as takeovers
from adeye.campaign.studies.forks import look_back
from adeye.judge.preventability import TAKEOVER_CLASSES
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.campaign.studies.forks import TakeoverMatrix
    from tests.project import Executed


@pytest.fixture(scope="module")
def db(mini: Executed, tmp_path_factory: pytest.TempPathFactory) -> Path:
    copy = tmp_path_factory.mktemp("takeovers") / "adeye.db"
    shutil.copyfile(mini.db, copy)
    return copy


@pytest.fixture(scope="module")
def matrix(db: Path) -> TakeoverMatrix:
    return look_back(db)


def test_what_was_found_is_kept_and_not_executed_again(
    db: Path, matrix: TakeoverMatrix, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object) -> list[object]:
        raise AssertionError

    monkeypatch.setattr(takeovers, "make_forks", never)
    assert look_back(db) == matrix
    with Repository.open(db, create=False) as repository:
        assert repository.verify() == ()


def test_every_run_has_one_class(matrix: TakeoverMatrix) -> None:
    assert matrix.looked_at == matrix.executed == sum(matrix.counts.values()) == 28
    assert tuple(matrix.counts) == TAKEOVER_CLASSES
    assert len({line.run for line in matrix.lines}) == 28


def test_missed_are_the_runs_that_end_in_contact_without_a_takeover(
    matrix: TakeoverMatrix, mini: Executed
) -> None:
    touched = {
        row["run"]
        for row in mini.project.rows()
        if row["end_reason"] == "contact" and row["architecture"] == "legacy_camera"
    }
    # The switch of the legacy architecture is stuck: nobody ever takes over there.
    missed = {line.run for line in matrix.lines if line.class_ == "missed"}
    assert touched
    assert missed == touched


def test_needed_takeovers_are_those_whose_fork_violates(matrix: TakeoverMatrix) -> None:
    needed = [line for line in matrix.lines if line.class_ == "needed_and_done"]
    assert needed
    for line in needed:
        assert line.takeover_s is not None
        assert line.violation_s is None
        assert line.fork_violation_s is not None
        assert line.fork_violation_s > line.takeover_s


@pytest.mark.slow
def test_sample_is_part_of_the_whole(
    mini: Executed, tmp_path: Path, matrix: TakeoverMatrix
) -> None:
    shutil.copyfile(mini.db, tmp_path / "adeye.db")
    part = look_back(tmp_path / "adeye.db", most=4)
    assert part.looked_at == 4
    assert set(part.lines) <= set(matrix.lines)


def test_precision_and_recall_are_those_of_the_lines(matrix: TakeoverMatrix) -> None:
    took = [line for line in matrix.lines if line.takeover_s is not None]
    needed = [line for line in took if line.class_ in {"needed_and_done", "late"}]
    assert matrix.precision == (len(needed), len(took))
    assert matrix.recall[0] == matrix.counts["needed_and_done"]
    assert matrix.recall[1] == len(needed) + matrix.avoidable
