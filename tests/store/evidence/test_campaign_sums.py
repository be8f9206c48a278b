from typing import Any

import pytest

from adeye.store.repository import Repository


@pytest.mark.slow
def test_sums_of_a_campaign_do_not_change_with_another_one(
    repository: Repository, example: Any
) -> None:
    campaign = example.campaign(repository, 4)
    before = repository.evidence.sums(campaign)
    assert before["run"][0] == before["metric"][0] == before["campaign_case"][0] == 4
    assert all(rows for rows, _ in before.values())
    example.thresholds = {"FSR1": "other"}
    other = example.campaign(repository, 8)
    assert repository.evidence.sums(campaign) == before
    assert repository.evidence.sums(other) != before
