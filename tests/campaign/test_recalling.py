"""Recalled runs of the mini campaign, part by part, and who is told how many are done."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import pytest

from adeye.campaign import replay as recalling
from adeye.campaign.replay import Counter, recalled_parts, together
from adeye.campaign.studies import forks as takeovers
from adeye.campaign.studies.fault_timing import campaign_injections
from adeye.campaign.studies.forks import look_back
from adeye.store.repository import Repository
from adeye.sweep.case import structure_key

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.campaign.run import Progress
    from tests.project import Executed


def test_parts_are_small_in_the_order_of_the_plan_and_hold_every_run_once(
    mini: Executed, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recalling, "PART_RUNS", 10)
    with Repository.open(mini.db, create=False) as repository:
        info = repository.latest_campaign()
        assert info is not None
        runs = repository.hindsight.executed(info.id)
        parts = list(recalled_parts(repository, runs))
    assert [len(part) for part in parts] == [10, 10, 8]
    assert [item.run.ordinal for part in parts for item in part] == list(range(28))


def test_together_is_what_has_one_structure(
    mini: Executed, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recalling, "MOST_TOGETHER", 3)
    with Repository.open(mini.db, create=False) as repository:
        info = repository.latest_campaign()
        assert info is not None
        (part,) = recalled_parts(repository, repository.hindsight.executed(info.id))
    batches = list(together(part, lambda item: item))
    assert max(map(len, batches)) == 3
    assert sum(map(len, batches)) == 28
    for batch in batches:
        assert len({structure_key(item.case) for item in batch}) == 1


def test_counter_tells_each_time_how_many_are_done() -> None:
    told: list[Progress] = []
    counter = Counter("forks", 5, told.append)
    counter.add(2)
    counter.add(3)
    assert [(item.phase, item.done, item.total) for item in told] == [
        ("forks", 0, 5),
        ("forks", 2, 5),
        ("forks", 5, 5),
    ]
    Counter("forks", 5, None).add(1)


@pytest.mark.slow
def test_looking_back_in_small_parts_finds_the_same_and_tells_how_far_it_is(
    mini: Executed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copyfile(mini.db, tmp_path / "whole.db")
    shutil.copyfile(mini.db, tmp_path / "parts.db")
    whole = look_back(tmp_path / "whole.db"), campaign_injections(tmp_path / "whole.db")
    monkeypatch.setattr(recalling, "PART_RUNS", 9)
    told: list[Progress] = []
    forks = look_back(tmp_path / "parts.db", report=told.append)
    assert (told[0].done, told[-1].done, told[-1].total) == (0, 28, 28)
    assert [item.done for item in told] == sorted(item.done for item in told)
    told.clear()
    faults = campaign_injections(tmp_path / "parts.db", report=told.append)
    assert told[-1].done == told[-1].total == faults.looked_at > 0
    assert (forks, faults) == whole


@pytest.mark.slow
def test_what_was_done_before_an_interruption_is_kept(
    mini: Executed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    db = tmp_path / "adeye.db"
    shutil.copyfile(mini.db, db)
    monkeypatch.setattr(recalling, "PART_RUNS", 9)

    def interrupt(progress: Progress) -> None:
        if progress.done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        look_back(db, report=interrupt)
    told: list[Progress] = []
    assert look_back(db, report=told.append).looked_at == 28
    assert 0 < told[0].total < 28
    assert takeovers.look_back(db).looked_at == 28
