"""Drives are kept beside the campaigns and found by run, model and edition."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from adeye.store import benchmarks

if TYPE_CHECKING:
    import pytest

    from adeye.store.repository import Repository


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
