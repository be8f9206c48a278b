"""Forks beside the campaigns: found by their digest, and counted by no campaign."""

from dataclasses import replace
from typing import Any

import pytest

from adeye.errors import IntegrityError
from adeye.store.block import run_block
from adeye.store.records import BlockCase
from adeye.store.repository import Repository
from adeye.store.tables import METRIC_IDS


@pytest.fixture
def campaign(repository: Repository, example: Any) -> str:
    return str(example.campaign(repository, 8))


def test_a_fork_is_found_where_its_run_stands(
    repository: Repository, example: Any, campaign: str
) -> None:
    fork = example.fork(repository, campaign)
    origin = repository.find_run("0", campaign=campaign)
    found = repository.find_run(fork.result_digest[:12])
    assert (found.campaign, found.ordinal, found.is_done) == (campaign, 0, True)
    assert (found.result_digest, found.test_case) == (fork.result_digest, fork.test_case)
    assert found.scenario == origin.scenario
    stored = repository.run_row(fork.result_digest)
    assert stored is not None
    assert [item.fsr_id for item in stored.verdicts] == ["FSR1"]


def test_the_test_case_of_a_fork_is_that_of_its_run_with_the_override(
    repository: Repository, example: Any, campaign: str
) -> None:
    fork = example.fork(repository, campaign)
    origin = repository.find_run("0", campaign=campaign)
    plain, forked = map(repository.test_case_row, (origin.test_case, fork.test_case))
    assert plain.fork is None
    assert forked.fork == fork
    assert replace(forked, test_case=plain.test_case, fork=None) == plain


def test_no_campaign_counts_a_fork(repository: Repository, example: Any, campaign: str) -> None:
    def seen() -> tuple[object, ...]:
        return (
            repository.progress(campaign),
            repository.fsr_status(campaign),
            repository.gate(campaign),
            repository.results(campaign),
            repository.result_table_hash(campaign),
            len(repository.campaigns()),
        )

    before = seen()
    example.fork(repository, campaign)
    assert seen() == before
    assert repository.verify() == ()


def test_the_same_fork_again_changes_nothing(
    repository: Repository, example: Any, campaign: str
) -> None:
    example.fork(repository, campaign)
    before = repository.info().rows
    example.fork(repository, campaign)
    assert repository.info().rows == before


def test_a_fork_that_comes_out_otherwise_is_refused(
    repository: Repository, example: Any, campaign: str
) -> None:
    fork = example.fork(repository, campaign)
    case = BlockCase(0, fork.test_case, fork.result_digest, has_result=False, missing_fsrs=())
    other = run_block([example.run(case, trace_digest="0" * 32)], METRIC_IDS)
    with pytest.raises(IntegrityError, match="differ"):
        repository.hindsight.save_forks([fork], other)


def test_results_of_other_forks_are_refused(
    repository: Repository, example: Any, campaign: str
) -> None:
    fork = example.fork(repository, campaign)
    with pytest.raises(ValueError, match="not those of the forks"):
        repository.hindsight.save_forks([fork], run_block([], METRIC_IDS))


def test_the_chain_of_a_run_is_read_link_by_link(repository: Repository, campaign: str) -> None:
    run = repository.find_run("0", campaign=campaign)
    stored = repository.run_row(run.result_digest)
    assert stored is not None
    assert stored.links is not None
    assert [len(link) for link in stored.links] == [32]
