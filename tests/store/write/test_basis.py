"""What judging again takes is written with a run and read by its number."""

from typing import Any

from adeye.store.repository import Repository


def test_basis_of_runs_is_read_by_number_and_version(repository: Repository, example: Any) -> None:
    campaign = example.campaign(repository, 4)
    again = repository.again
    results = [item.result for item in again.evidence(campaign)]
    numbers = list(again.numbers(results).values())
    bases = again.bases(numbers, 1)
    assert set(bases) == set(numbers)
    assert again.bases(numbers, 2) == {}
    assert all(item[2] == {"min_distance_m": "adeye:min_distance@1"} for item in bases.values())
    assert any(item[1] == "not realised" for item in bases.values())
    measured = again.metric(numbers, "min_distance_m")
    assert {item[1] for item in measured.values()} == {"value"}
    assert set(again.extremes(numbers, "least gap", 1)) == set(numbers)
    assert again.extremes(numbers, "greatest gap", 1) == {}
    assert {number for number, _, _ in again.files(numbers)} == set(numbers)
