"""Campaigns and runs: how they are found, counted, and told from each other."""

import json
import random  # noqa: TID251 - tests may draw
from datetime import date
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from adeye.errors import InputError, IntegrityError, UsageError
from adeye.judge.verdict import Verdict
from adeye.spec.concept import Waiver
from adeye.store.repository import Repository
from tests.refusals import refused
from tests.store.conftest import Store
from tests.stored import known


@pytest.fixture
def campaign(store: Store) -> str:
    return str(store.campaign(8))


def test_campaigns_are_listed_the_newest_first(store: Store, campaign: str) -> None:
    store.example.with_odd("2")
    second = store.plan(12).campaign
    found = store.repository.campaigns()
    assert [item.id for item in found] == [second, campaign]
    assert [item.number for item in found] == [2, 1]
    assert [item.state for item in found] == ["interrupted", "complete"]
    assert (found[1].odd, found[1].planned, found[1].gate) == ("motorway", 8, ("new",))
    assert found[1].factors == [{"scenario": "cut_in", "points": 2}]
    assert found[1].provenance == {"tool": "0.1.0"}


def test_campaign_is_found_by_any_name(repository: Repository, campaign: str) -> None:
    found = repository.latest_campaign()
    for name in ("1", campaign, campaign[:6], "latest", "motorway", "@{-0}"):
        assert repository.find_campaign(name) == found
    assert found == repository.latest_campaign("motorway")
    assert repository.latest_campaign("urban") is None


def test_names_of_nothing_are_input_errors(repository: Repository, campaign: str) -> None:
    for name, message in (
        ("2", "not the beginning"),
        ("xyz!", "not the beginning"),
        ("0" * 32, "there is none"),
        ("@{-x}", "not the beginning"),
    ):
        caught = refused(InputError, repository.find_campaign, name, says=message)
        assert f"There are: 1 (motorway, {campaign[:10]})." in str(caught)
    for name in ("", "ab", "5", "ABCD", "%%%%", "____", "' OR 1=1", "٣٣٣٣"):
        refused(InputError, repository.find_run, name, says="not the beginning of a digest")
    refused(InputError, repository.find_run, "99999", campaign=campaign, says="run '99999'")
    refused(IntegrityError, repository.test_case_row, "0" * 64, says="is gone")


def test_campaign_before_the_latest_is_counted_back(repository: Repository, campaign: str) -> None:
    refused(UsageError, repository.find_campaign, "@{-1}", says="has no campaign 1 before number 1")
    refused(UsageError, repository.campaign_before, repository.find_campaign(), says="before")
    assert repository.campaign_before(repository.find_campaign(), 0).id == campaign


def test_run_is_found_by_ordinal_and_by_prefix(store: Store, campaign: str) -> None:
    by_ordinal = store.repository.find_run("5", campaign=campaign)
    assert by_ordinal.ordinal == 5
    assert by_ordinal.result_digest == store.example.case(5).result_digest
    assert by_ordinal.is_done
    assert store.repository.find_run(by_ordinal.result_digest[:10]) == by_ordinal
    assert store.repository.find_run(by_ordinal.result_digest, campaign=campaign) == by_ordinal


def test_run_in_two_campaigns_is_shown_in_the_newest(store: Store, campaign: str) -> None:
    store.example.with_odd("2")
    second = store.campaign(12)
    shared, own = (store.example.case(ordinal).result_digest for ordinal in (5, 11))
    assert store.repository.find_run(shared).campaign == second
    assert store.repository.find_run(shared, campaign=campaign).campaign == campaign
    assert store.repository.find_run(own).campaign == second
    with pytest.raises(InputError, match="is not in campaign"):
        store.repository.find_run(own, campaign=campaign)


def test_planned_run_is_found_and_counts_when_it_is_saved(store: Store) -> None:
    campaign = store.plan(8, block_size=3).campaign
    assert not store.repository.find_run("1", campaign=campaign).is_done
    assert store.complete(store.claim(campaign))
    progress = store.repository.progress(campaign)
    assert (progress.planned, progress.executed, progress.accounted) == (8, 3, 3)


def test_ambiguous_prefix_lists_what_it_could_be(store: Store) -> None:
    cases = [store.example.case(4 * ordinal) for ordinal in range(1500)]
    store.plan(cases)
    digests = sorted(case.result_digest for case in cases)
    prefix = next(first[:4] for first, second in pairwise(digests) if first[:4] == second[:4])
    caught = refused(InputError, store.repository.find_run, prefix, says="ambiguous")
    for digest in digests:
        assert (digest[:12] in str(caught)) == digest.startswith(prefix)


def test_test_case_can_be_made_again_from_what_is_stored(store: Store) -> None:
    case = store.example.case(1, faults=[{"id": "out"}], fault_entry="out")
    store.plan([case])
    stored = store.repository.test_case_row(case.test_case)
    assert stored.scenario == case.scenario_content.content
    assert stored.architecture == case.architecture_content.content
    assert stored.faults == ({"id": "out"},)
    assert (stored.parameters, stored.step_s) == (json.loads(case.parameters[0]), 0.05)
    assert (stored.seed, stored.replicate, stored.point_index) == (7, 0, 0)
    assert store.repository.content("odd", stored.odd_digest) == store.example.odd.content


def test_campaign_that_was_planned_again_is_the_latest(store: Store) -> None:
    def latest() -> str:
        found = known(store.repository.latest_campaign())
        asked = store.rows("SELECT campaign FROM v_campaigns WHERE recency = 1")
        assert asked == [(found.id,)]
        return found.id

    # The same once more changes nothing, another one does.
    planned: dict[int, str] = {}
    for count in (4, 2, 4, 4, 3, 2):
        campaign = store.campaign(count)
        assert planned.setdefault(count, campaign) == campaign
        assert latest() == campaign
    assert store.repository.info().rows["campaign_use"] == 2
    assert store.repository.verify() == ()


def test_run_of_several_campaigns_is_shown_in_the_one_planned_last(store: Store) -> None:
    first = store.campaign(4)
    (run, *_) = (item.result for item in store.repository.again.evidence(first))
    second = store.campaign(2)
    assert store.repository.find_run(run).campaign == second
    store.campaign(4)
    assert store.repository.find_run(run).campaign == first


def worked_off(path: Path, example: Any, *, block_size: int, seed: int) -> str:
    """Execute one plan with random blocks abandoned and completed out of order."""
    picks = random.Random(seed)  # noqa: S311 - order only
    with Repository.open(path) as repository:
        store = Store(repository, example)
        campaign = store.plan(16, block_size=block_size).campaign
        held = []
        while (block := repository.claim_block(campaign=campaign)) is not None:
            if picks.random() < 0.3:
                assert repository.release_block(block)
                continue
            held.append(block)
            if picks.random() < 0.5:
                picks.shuffle(held)
                done = held.pop()
                runs = [example.run(case, executed_by=str(seed)) for case in done.to_execute]
                picks.shuffle(runs)
                assert store.complete(done, runs)
        for block in held:
            assert store.complete(block)
        assert repository.verify() == ()
        return store.result_hash(campaign)


@pytest.mark.slow
def test_hash_of_results_is_that_of_the_plan(tmp_path: Path, example: Any) -> None:
    hashes = {
        worked_off(tmp_path / f"{size}-{seed}.db", example, block_size=size, seed=seed)
        for size in (1, 3, 64)
        for seed in range(3)
    }
    assert len(hashes) == 1


def test_hash_of_results_notices_one_different_run(tmp_path: Path, example: Any) -> None:
    changed = {"trace_digest": "f" * 32, "outcome_detail": "f" * 32, "duration_s": 16.0}
    hashes = set()
    for name in ("nothing", *changed):
        with Repository.open(tmp_path / f"{name}.db") as repository:
            store = Store(repository, example)
            block = store.claim(store.plan(4).campaign)
            runs = store.example.runs(block)
            if name in changed:
                runs[2] = example.run(block.cases[2], **{name: changed[name]})
            assert store.complete(block, runs)
            hashes.add(store.result_hash(block.campaign))
    assert len(hashes) == 4


def test_status_counts_by_architecture_and_scenario(store: Store) -> None:
    store.example.judge(Verdict.FAIL, 4)
    campaign = store.campaign(8)
    status = {
        (item.fsr, item.architecture, item.scenario): item
        for item in store.repository.fsr_status(campaign)
    }
    failing = status["FSR1", "legacy", "cut_in"]
    assert failing.verdict is Verdict.FAIL
    assert (failing.counts[Verdict.FAIL], failing.counts[Verdict.PASS]) == (1, 1)
    assert (failing.worst_margin, failing.unit, failing.planned) == (-5.0, "m", 2)
    assert failing.worst_run == store.example.case(4).result_digest
    assert (failing.is_mandatory, failing.is_in_gate) == (True, False)
    assert status["FSR2", "new", "braking"].verdict is Verdict.PASS
    assert not status["FSR2", "new", "braking"].is_mandatory


@pytest.mark.parametrize(
    ("judged", "verdicts"),
    [
        (Verdict.INCONCLUSIVE, (Verdict.PASS, Verdict.PASS, Verdict.INCONCLUSIVE)),
        (Verdict.FAIL, (Verdict.FAIL,) * 3),
    ],
)
def test_waiver_sets_a_gap_aside_until_it_expires_and_hides_no_fail(
    store: Store, judged: Verdict, verdicts: tuple[Verdict, ...]
) -> None:
    store.example.judge(judged, 1)
    store.example.waivers = (
        Waiver(requirement="FSR1", reason="known", author="me", expires=date(2030, 1, 1)),
    )
    campaign = store.campaign(8)
    days = (date(2029, 12, 31), date(2030, 1, 1), date(2030, 1, 2))
    for day, verdict in zip(days, verdicts, strict=True):
        gate = store.repository.gate(campaign, on=day)
        (found,) = [i.verdict for i in gate if (i.fsr, i.architecture) == ("FSR1", "new")]
        assert found is verdict
    # Without a day it takes today.
    assert store.repository.gate(campaign) == store.repository.gate(campaign, on=date.today())  # noqa: DTZ011


def test_worst_runs_come_first(store: Store) -> None:
    store.example.judge(Verdict.FAIL, 4, 8)
    campaign = store.campaign(12)
    worst = store.repository.worst_runs(campaign, "FSR1", limit=4)
    assert [run.ordinal for run, _ in worst] == [8, 4, 0, 1]
    assert [record.margin for _, record in worst] == [-9.0, -5.0, 1.0, 2.0]
    only = store.repository.worst_runs(
        campaign, "FSR1", architecture="new", scenario="cut_in", verdict=Verdict.PASS, limit=1
    )
    assert [run.ordinal for run, _ in only] == [1]


@pytest.mark.parametrize("limit", [1, 3, 12])
def test_worst_runs_are_found_whatever_the_blocks(store: Store, limit: int) -> None:
    # Ties in every block, and failures in the last one only.
    store.example.verdict_of = lambda case, _fsr: Verdict.FAIL if case.ordinal > 9 else Verdict.PASS
    store.example.margin_of = lambda case: float(case.ordinal % 3)
    campaign = store.campaign(12, block_size=2)
    everything = store.repository.worst_runs(campaign, "FSR1", limit=100)
    worst = store.repository.worst_runs(campaign, "FSR1", limit=limit)
    assert worst == everything[:limit]
    places = {run.ordinal: place for place, (run, _) in enumerate(everything)}
    assert sorted(places) == list(range(12))
    for (one, first), (two, second) in pairwise(everything):
        if first.verdict is second.verdict and first.margin == second.margin:
            assert (one.result_digest, one.ordinal) < (two.result_digest, two.ordinal)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_withdrawn_run_is_not_the_worst_nor_are_its_numbers(store: Store, seed: int) -> None:
    draw = random.Random(seed)  # noqa: S311
    kinds = [Verdict.FAIL, Verdict.PASS, Verdict.VACUOUS, Verdict.INCONCLUSIVE]
    drawn, margins = draw.choices(kinds, k=48), draw.choices(range(1, 6), k=48)
    store.example.verdict_of = lambda case, _: drawn[case.ordinal]
    store.example.margin_of = lambda case: float(margins[case.ordinal])
    campaign = store.campaign(48, block_size=24)
    ranked = "SELECT run FROM v_verdicts WHERE fsr = 'FSR1' AND verdict <> 'NOT_RUN'"
    ranked += " AND verdict <> 'VACUOUS'"
    by = " ORDER BY verdict = 'FAIL' DESC, margin, run"
    for _ in range(6):
        left = [run for (run,) in store.rows(ranked + by)]
        for limit in (1, 3):
            worst = store.repository.worst_runs(campaign, "FSR1", limit=limit)
            assert [ref.result_digest for ref, _ in worst] == left[:limit]
        told = "SELECT architecture, worst_run FROM v_gate WHERE fsr = 'FSR1'"
        own = {
            name: store.rows(f"{ranked} AND architecture = '{name}'{by} LIMIT 1")
            for name in ("new", "legacy")
        }
        assert dict(store.rows(told)) == {
            name: rows[0][0] if rows else None for name, rows in own.items()
        }
        store.repository.evidence.withdraw(left[0], author="me", reason="wrong map")


def test_worst_runs_are_those_of_the_fsr_as_the_campaign_judges_it(store: Store) -> None:
    first = store.campaign(4)
    store.example.thresholds["FSR1"] = "3 m"
    store.example.verdict_of = lambda _case, _fsr: Verdict.FAIL
    second = store.campaign(4)
    assert store.repository.worst_runs(first, "FSR1")[0][1].verdict is Verdict.PASS
    assert store.repository.worst_runs(second, "FSR1")[0][1].verdict is Verdict.FAIL


def test_runs_that_fail_an_fsr_are_told_from_those_that_do_not(store: Store) -> None:
    failing = {(1, "FSR2"): Verdict.FAIL, (5, "FSR1"): Verdict.FAIL}
    store.example.verdict_of = lambda case, fsr: failing.get((case.ordinal, fsr), Verdict.PASS)
    campaign = store.campaign(8)
    assert store.repository.hindsight.failed_among(campaign, range(8)) == {1, 5}
    assert store.repository.hindsight.failed_among(campaign, [0, 5]) == {5}
    assert store.repository.hindsight.failed_among(campaign, []) == frozenset()


def test_results_are_one_row_a_run_in_the_order_of_the_plan(store: Store) -> None:
    campaign = store.campaign(8)
    table = store.repository.results(campaign)
    assert [row[table.columns.index("ordinal")] for row in table.rows] == list(range(8))
    assert {"scenario", "architecture", "min_ttc_s", "verdicts"} <= set(table.columns)


def test_failed_channels_are_counted_from_the_runs(store: Store) -> None:
    campaign = store.campaign(8)
    assert store.repository.failed_channels(campaign) == ()
    store.raw.execute("DROP TRIGGER run_no_update")
    changed = "UPDATE run SET outcome = ?, outcome_channel = ? WHERE number BETWEEN ? AND ?"
    for values in (("CRASH", "nominal", 1, 3), ("TIMEOUT", "safety", 4, 4)):
        store.raw.execute(changed, values)
    found = store.repository.failed_channels(campaign)
    assert sum(item[5] for item in found) == 4
    assert {item[1:3] for item in found} == {("nominal", "CRASH: "), ("safety", "TIMEOUT: ")}
    assert not any(item[3] or item[4] for item in found)
    assert store.repository.failed_channels("f" * 32) == ()
