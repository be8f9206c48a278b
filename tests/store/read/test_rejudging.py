"""What judging again reads and counts."""

from typing import Any

import pytest

from adeye.judge.verdict import Verdict
from adeye.store.repository import Repository


def test_evidence_is_what_was_judged(repository: Repository, example: Any) -> None:
    campaign = example.campaign(repository, 4)
    found = list(repository.again.evidence(campaign))
    assert len(found) == 4
    assert {item.fsrs for item in found} == {("FSR1", "FSR2")}
    numbers = repository.again.numbers([item.result for item in found])
    judged = repository.again.judged(list(numbers.values()))
    assert all(example.fsr_digest("FSR1") in digests for digests in judged.values())
    assert repository.again.fsr_digests(campaign)["FSR1"] == example.fsr_digest("FSR1")


@pytest.mark.slow
def test_block_that_lacks_one_fsr_counts_the_others(repository: Repository, example: Any) -> None:
    example.campaign(repository, 4)
    example.thresholds["FSR1"] = "3 m"
    plan = repository.plan_campaign(example.record(), example.cases(4), block_size=4)
    while (block := repository.claim_block(campaign=plan.campaign)) is not None:
        repository.again.tally(block)
    status = {
        (item.fsr, item.counts.get(Verdict.NOT_RUN, 0))
        for item in repository.fsr_status(plan.campaign)
    }
    assert {fsr for fsr, missing in status if missing and fsr != "FSR3"} == {"FSR1"}
    assert repository.verify() == ()
