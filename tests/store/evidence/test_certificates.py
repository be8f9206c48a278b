"""Certificates stay beside their campaigns, the newest first."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from adeye.errors import IntegrityError
from adeye.store.evidence.roots import CertificateRecord

if TYPE_CHECKING:
    from adeye.store.repository import Repository
    from tests.store.conftest import Example

FINDING = {"run": "ab", "first_tick": 100}


@pytest.fixture
def record(example: Example, repository: Repository) -> CertificateRecord:
    campaign = example.campaign(repository)
    conditions = [{"condition": "batches of 7", "runs": 3}]
    return CertificateRecord(campaign, "0.1", "portable", 8, 1000, 3, 1, conditions, [])


@pytest.mark.slow
def test_certificates_come_back_the_newest_first(
    record: CertificateRecord, repository: Repository
) -> None:
    certificates = repository.hindsight.certificates
    certificates.save(record)
    certificates.save(replace(record, class_="same platform", findings=[FINDING]))
    newest, oldest = certificates.of(record.campaign)
    assert newest.findings == [FINDING]
    assert newest.class_ == "same platform"
    assert replace(oldest, at="") == record
    assert oldest.at.endswith("+00:00")
    assert repository.verify() == ()
    assert certificates.of("0" * 32) == ()


def test_sample_of_nothing_is_refused(record: CertificateRecord, repository: Repository) -> None:
    with pytest.raises(IntegrityError):
        repository.hindsight.certificates.save(replace(record, sampled=0))


def test_executed_runs_are_each_once_in_the_order_of_the_plan(
    record: CertificateRecord, repository: Repository
) -> None:
    executed = repository.hindsight.certificates.executed(record.campaign)
    ordinals = [item.run.ordinal for item in executed]
    assert ordinals == sorted(ordinals)
    digests = [item.run.result_digest for item in executed]
    assert len(set(digests)) == len(digests) > 0
    assert {len(item.stratum) for item in executed} == {3}
