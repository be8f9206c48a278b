"""Drives are kept beside the campaigns and found by run, model and edition."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING, Any

import pytest

from adeye.store.repository import Repository
from adeye.store.write import studies as benchmarks

if TYPE_CHECKING:
    from pathlib import Path

    import pytest

    from tests.project import Executed


@pytest.mark.slow
def test_what_is_kept_is_found_once_and_the_same_again_changes_nothing(
    repository: Repository, example: Any
) -> None:
    campaign = example.campaign(repository, 4)
    example.hindsight(repository, campaign)
    kept = repository.hindsight.benchmarks
    (found,) = kept.comparisons(campaign)
    assert (found.model, found.edition, found.drive) == ("cc", "r157-01", found.run)
    assert found.cell in {"both_avoid", "neither", "unknown"}
    before = repository.info().rows
    kept.save((), (), None, [benchmarks.DriveRecord(found.run, "cc", "r157-01", found.run)])
    assert repository.info().rows == before
    assert repository.verify() == ()


def test_drives_of_another_version_are_not_taken(
    repository: Repository, example: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign = example.campaign(repository, 4)
    example.hindsight(repository, campaign)
    monkeypatch.setattr(benchmarks, "BENCHMARK_VERSION", 9)
    assert repository.hindsight.benchmarks.comparisons(campaign) == []


def test_every_executed_run_is_a_candidate_once(repository: Repository, example: Any) -> None:
    campaign = example.campaign(repository, 4)
    found = repository.hindsight.benchmarks.candidates(campaign)
    assert [item.run.ordinal for item in found] == list(range(len(found)))
    assert len(found) == repository.progress(campaign).executed


def test_contacts_without_a_drive_are_open_until_they_have_one(
    mini: Executed, tmp_path: Path
) -> None:
    db = shutil.copyfile(mini.db, tmp_path / "adeye.db")
    with Repository.open(db, create=False) as repository:
        campaign, kept = mini.summary.campaign, repository.hindsight.benchmarks
        found = kept.candidates(campaign)
        contacts = sorted(item.run.result_digest for item in found if item.contact is not False)
        assert 0 < len(contacts) == kept.open_contacts(campaign)
        drives = [benchmarks.DriveRecord(run, "cc", "r157-01", run) for run in contacts]
        kept.save((), (), None, drives[:1])
        assert kept.open_contacts(campaign) == len(contacts) - 1
        kept.save((), (), None, drives)
        assert kept.open_contacts(campaign) == 0
        assert kept.open_contacts("f" * 32) == 0


def test_contact_whose_drive_is_of_another_version_is_open(
    mini: Executed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    db = shutil.copyfile(mini.db, tmp_path / "adeye.db")
    with Repository.open(db, create=False) as repository:
        campaign, kept = mini.summary.campaign, repository.hindsight.benchmarks
        before = kept.open_contacts(campaign)
        runs = [item.run.result_digest for item in kept.candidates(campaign)]
        kept.save((), (), None, [benchmarks.DriveRecord(r, "cc", "r157-01", r) for r in runs])
        monkeypatch.setattr(benchmarks, "BENCHMARK_VERSION", 9)
        assert kept.open_contacts(campaign) == before > 0
