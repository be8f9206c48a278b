from typing import Any

import pytest

from adeye.errors import InputError
from adeye.judge.verdict import ExitCode, Verdict
from adeye.store.evidence.roots import Proof
from adeye.store.read.totals import gate_code
from adeye.store.repository import Repository


@pytest.fixture
def campaign(repository: Repository, example: Any) -> str:
    example.requirements = example.requirements[:1]
    return str(example.campaign(repository, 8))


def test_run_is_proven_with_the_root_alone(repository: Repository, campaign: str) -> None:
    root = repository.evidence.record_root(campaign)
    assert root is not None
    proof = repository.evidence.prove("5", campaign)
    assert (proof.ordinal, proof.leaves, proof.root) == (5, 8, root.root)
    path = tuple(bytes.fromhex(item) for item in proof.path)
    assert Proof(5, 8, path).root(bytes.fromhex(proof.leaf)).hex() == root.root


def test_sessions_tell_who_and_with_what(repository: Repository, campaign: str) -> None:
    told = {
        "adeye": "9", "who": "jo", "host": "h", "cpu": {"name": "fast"}, "packages": {"numpy": "2"},
    }  # fmt: skip
    repository.evidence.add_session(campaign, told)
    repository.evidence.add_session(campaign, {"packages": {"numpy": "3"}})
    one, two = repository.evidence.sessions(campaign)
    assert (one.who, one.host, one.tool, one.cpu, one.provenance) == ("jo", "h", "9", "fast", told)
    assert one.packages_digest != two.packages_digest
    assert (one.number, two.number, two.who) == (1, 2, "")
    assert repository.evidence.sessions("none") == ()


@pytest.mark.slow
def test_withdrawn_result_is_no_evidence_in_any_campaign(
    repository: Repository, example: Any, campaign: str
) -> None:
    assert gate_code(repository, repository.find_campaign(campaign))[0] is ExitCode.OK
    run = repository.find_run("1", campaign=campaign)
    before = repository.run_row(run.result_digest)
    assert repository.evidence.withdraw(run.result_digest, author=" jo ", reason="wrong map")
    assert not repository.evidence.withdraw(run.result_digest, author="jo", reason="again")
    (told,) = repository.evidence.withdrawals(campaign)
    assert (told.author, told.reason, told.result_digest) == ("jo", "wrong map", run.result_digest)
    code, message = gate_code(repository, repository.find_campaign(campaign))
    assert code is ExitCode.INCOMPLETE
    assert f"1 results are withdrawn ({run.result_digest[:12]} by jo: wrong map)" in message
    (status,) = [item for item in repository.gate(campaign) if item.architecture == "new"]
    assert status.verdict is Verdict.NOT_RUN
    assert (status.counts[Verdict.PASS], status.counts[Verdict.NOT_RUN]) == (3, 1)
    assert repository.run_row(run.result_digest) == before
    assert repository.verify() == ()
    wider = example.campaign(repository, 12)
    assert gate_code(repository, repository.find_campaign(wider))[0] is ExitCode.INCOMPLETE


@pytest.mark.slow
def test_withdrawn_failure_is_not_counted_and_not_green(
    repository: Repository, example: Any
) -> None:
    example.requirements = example.requirements[:1]
    example.verdict_of = lambda case, _: Verdict.FAIL if case.ordinal == 1 else Verdict.PASS
    campaign = repository.find_campaign(example.campaign(repository, 8))
    assert gate_code(repository, campaign)[0] is ExitCode.FAILED
    run = repository.find_run("1", campaign=campaign.id)
    repository.evidence.withdraw(run.result_digest, author="jo", reason="wrong map")
    assert gate_code(repository, campaign)[0] is ExitCode.INCOMPLETE


def test_many_withdrawals_are_counted(repository: Repository, campaign: str) -> None:
    for ordinal in "13570":
        run = repository.find_run(ordinal, campaign=campaign)
        repository.evidence.withdraw(run.result_digest, author="jo", reason="wrong map")
    _, message = gate_code(repository, repository.find_campaign(campaign))
    assert "; 2 more)" in message


@pytest.mark.parametrize("given", [{"author": " ", "reason": "r"}, {"author": "a", "reason": ""}])
def test_withdrawal_needs_author_and_reason(
    repository: Repository, campaign: str, given: dict[str, str]
) -> None:
    run = repository.find_run("1", campaign=campaign)
    with pytest.raises(InputError, match="is empty"):
        repository.evidence.withdraw(run.result_digest, **given)
    assert repository.evidence.withdrawals() == ()


def test_kept_files_name_their_runs(repository: Repository, campaign: str) -> None:
    files = repository.evidence.kept_files(campaign)
    assert files == repository.evidence.kept_files()
    assert sum(len(runs) for runs in files.values()) == 8
    assert repository.evidence.kept_files("none") == {}
