"""What judging again reads and counts."""

import pytest

from adeye.judge.verdict import Verdict
from tests.store.conftest import Store


def test_evidence_is_what_was_judged(store: Store) -> None:
    campaign = store.campaign(4)
    found = list(store.repository.again.evidence(campaign))
    assert len(found) == 4
    assert {item.fsrs for item in found} == {("FSR1", "FSR2")}
    numbers = store.repository.again.numbers([item.result for item in found])
    judged = store.repository.again.judged(list(numbers.values()))
    assert all(store.example.fsr_digest("FSR1") in digests for digests in judged.values())
    assert store.repository.again.fsr_digests(campaign)["FSR1"] == store.example.fsr_digest("FSR1")


@pytest.mark.slow
def test_block_that_lacks_one_fsr_counts_the_others(store: Store) -> None:
    store.campaign(4)
    store.example.thresholds["FSR1"] = "3 m"
    plan = store.plan(4, block_size=4)
    while (block := store.repository.claim_block(campaign=plan.campaign)) is not None:
        store.repository.again.tally(block)
    status = {
        (item.fsr, item.counts.get(Verdict.NOT_RUN, 0))
        for item in store.repository.fsr_status(plan.campaign)
    }
    assert {fsr for fsr, missing in status if missing and fsr != "FSR3"} == {"FSR1"}
    assert store.repository.verify() == ()
