from contextlib import closing
from itertools import pairwise
from typing import Any

import pytest

from adeye.errors import InputError
from adeye.store.repository import Repository
from tests.store.raw import raw_connection


@pytest.fixture
def campaign(repository: Repository, example: Any) -> str:
    return str(example.campaign(repository, 8))


def test_campaigns_are_listed_the_newest_first(
    repository: Repository, example: Any, campaign: str
) -> None:
    example.with_odd("2")
    second = repository.plan_campaign(example.record(), example.cases(12)).campaign
    found = repository.campaigns()
    assert [item.id for item in found] == [second, campaign]
    assert [item.number for item in found] == [2, 1]
    assert [item.state for item in found] == ["interrupted", "complete"]
    assert (found[1].odd, found[1].planned, found[1].gate) == ("motorway", 8, ("new",))
    assert found[1].factors == [{"scenario": "cut_in", "points": 2}]
    assert found[1].provenance == {"tool": "0.1.0"}


def test_latest_campaign_is_that_of_the_odd(repository: Repository, campaign: str) -> None:
    latest = repository.latest_campaign("motorway")
    assert latest is not None
    assert latest.id == campaign
    assert repository.latest_campaign() == latest
    assert repository.latest_campaign("urban") is None


def test_campaign_is_found_by_number_id_and_prefix(repository: Repository, campaign: str) -> None:
    for name in ("1", campaign, campaign[:6]):
        assert repository.find_campaign(name).id == campaign


@pytest.mark.parametrize(
    ("name", "message"),
    [("2", "not the beginning"), ("xyz!", "not the beginning"), ("0" * 32, "there is none")],
)
def test_unknown_campaign_is_an_input_error(
    repository: Repository, campaign: str, name: str, message: str
) -> None:
    assert campaign
    with pytest.raises(InputError, match=message) as caught:
        repository.find_campaign(name)
    assert f"There are: 1 (motorway, {campaign[:10]})." in str(caught.value)


def test_run_is_found_by_ordinal_and_by_prefix(
    repository: Repository, example: Any, campaign: str
) -> None:
    by_ordinal = repository.find_run("5", campaign=campaign)
    assert by_ordinal.ordinal == 5
    assert by_ordinal.result_digest == example.case(5).result_digest
    assert by_ordinal.is_done
    assert repository.find_run(by_ordinal.result_digest[:10]) == by_ordinal
    assert repository.find_run(by_ordinal.result_digest, campaign=campaign) == by_ordinal


def test_run_in_two_campaigns_is_shown_in_the_newest(
    repository: Repository, example: Any, campaign: str
) -> None:
    example.with_odd("2")
    second = example.campaign(repository, 8)
    digest = example.case(5).result_digest
    assert repository.find_run(digest).campaign == second
    assert repository.find_run(digest, campaign=campaign).campaign == campaign


def test_planned_run_is_found_before_it_is_executed(repository: Repository, example: Any) -> None:
    plan = repository.plan_campaign(example.record(), example.cases(2))
    assert not repository.find_run("1", campaign=plan.campaign).is_done


@pytest.mark.slow
def test_ambiguous_prefix_lists_what_it_could_be(repository: Repository, example: Any) -> None:
    cases = [example.case(4 * ordinal) for ordinal in range(1500)]
    repository.plan_campaign(example.record(), cases)
    digests = sorted(case.result_digest for case in cases)
    prefix = next(first[:4] for first, second in pairwise(digests) if first[:4] == second[:4])
    with pytest.raises(InputError, match="ambiguous") as caught:
        repository.find_run(prefix)
    for digest in digests:
        assert (digest[:12] in str(caught.value)) == digest.startswith(prefix)


@pytest.mark.parametrize("name", ["", "ab", "5", "ABCD", "%%%%", "____", "' OR 1=1", "٣٣٣٣"])
def test_run_name_that_is_no_prefix_is_refused(
    repository: Repository, campaign: str, name: str
) -> None:
    assert campaign
    with pytest.raises(InputError, match="not the beginning of a digest"):
        repository.find_run(name)


def test_ordinal_beyond_the_plan_is_an_input_error(repository: Repository, campaign: str) -> None:
    with pytest.raises(InputError, match="run '99999'"):
        repository.find_run("99999", campaign=campaign)


def test_run_of_another_campaign_is_not_found(
    repository: Repository, example: Any, campaign: str
) -> None:
    example.with_odd("2")
    second = example.campaign(repository, 12)
    digest = example.case(11).result_digest
    assert repository.find_run(digest).campaign == second
    with pytest.raises(InputError, match="is not in campaign"):
        repository.find_run(digest, campaign=campaign)


def test_test_case_can_be_made_again_from_what_is_stored(
    repository: Repository, example: Any
) -> None:
    case = example.case(1, faults=[{"id": "out"}], fault_entry="out")
    repository.plan_campaign(example.record(), [case])
    stored = repository.test_case_row(case.test_case)
    assert stored.scenario == case.scenario_content.content
    assert stored.architecture == case.architecture_content.content
    assert stored.faults == ({"id": "out"},)
    assert (stored.parameters, stored.step_s) == (case.parameters, 0.05)
    assert (stored.seed, stored.replicate, stored.point_index) == (7, 0, 0)
    assert repository.content("odd", stored.odd_digest) == example.odd.content


def test_unknown_test_case_is_an_input_error(repository: Repository) -> None:
    with pytest.raises(InputError, match="there is none"):
        repository.test_case_row("0" * 64)


@pytest.mark.slow
def test_campaign_that_was_planned_again_is_the_latest(
    repository: Repository, example: Any
) -> None:
    def latest() -> str:
        found = repository.latest_campaign()
        assert found is not None
        with closing(raw_connection(repository)) as connection:
            asked = connection.execute(
                "SELECT campaign FROM v_campaigns WHERE recency = 1"
            ).fetchone()
        assert asked == (found.id,)
        return found.id

    first, second = example.campaign(repository, 4), example.campaign(repository, 2)
    assert latest() == second
    assert example.campaign(repository, 4) == first
    assert latest() == first
    # The same once more changes nothing, another one does.
    assert example.campaign(repository, 4) == first
    assert latest() == first
    third = example.campaign(repository, 3)
    assert latest() == third
    assert example.campaign(repository, 2) == second
    assert latest() == second
    with closing(raw_connection(repository)) as connection:
        assert connection.execute("SELECT COUNT(*) FROM campaign_use").fetchone() == (3,)
    assert repository.verify() == ()


def test_run_of_several_campaigns_is_shown_in_the_one_planned_last(
    repository: Repository, example: Any
) -> None:
    first = example.campaign(repository, 4)
    (run, *_) = (item.result for item in repository.again.evidence(first))
    second = example.campaign(repository, 2)
    assert repository.find_run(run).campaign == second
    example.campaign(repository, 4)
    assert repository.find_run(run).campaign == first
