"""A part of a campaign is executed: what counts, what stays NOT_RUN, and the exit code."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from adeye.campaign import run as runner
from adeye.campaign.run import Limits, Progress, Session, run_campaign
from adeye.campaign.selection import Choice, Keyword, Shard
from adeye.judge.verdict import ExitCode, Verdict
from adeye.store.owner import Owner
from adeye.store.repository import Repository
from tests.project import CONCEPT, MINI, Project, count_rows, table_hash

if TYPE_CHECKING:
    from adeye.campaign.summary import CampaignSummary
    from adeye.store.records import Block
    from tests.conftest import MakeProject

SMALL: dict[str, Any] = {
    **MINI,
    "scenarios": [
        {
            "use": "cut_in",
            "faults": ["none", "nominal_silent"],
            "sweep": {"parameters": {"ego_speed": ["120 km/h"], "gap": ["30 m", "50 m"]}},
        }
    ],
}
"""Eight test cases: the candidate passes, legacy_camera does not."""
FAR = Owner("another machine", 1, "1")


@pytest.fixture
def small(make_project: MakeProject) -> Project:
    return make_project(SMALL)


def run(project: Project, *, db: str = "", **session: Any) -> CampaignSummary:
    asked = Session(**session)
    return run_campaign(project.plan(), db=project.folder / db if db else project.db, session=asked)


def word(text: str) -> dict[str, Any]:
    return {"choice": Choice(keyword=Keyword.parse(text))}


def fails_for_the_candidate(project: Project) -> None:
    """Ask for what no run holds."""
    with project.edited(CONCEPT) as concept:
        requirement = next(item for item in concept["requirements"] if item["id"] == "FSR-06")
        requirement["formula"] = "always(abs(ego.lane_offset) <= 0.0001 m)"


@pytest.mark.slow
def test_shards_are_parts_of_one_campaign_and_none_of_them_is_green(small: Project) -> None:
    parts = [run(small, choice=Choice(shard=Shard(place, 2))) for place in (1, 2)]
    assert parts[0].campaign == parts[1].campaign
    assert [item.executed for item in parts] == [4, 4]
    assert parts[0].exit_code is ExitCode.INCOMPLETE
    assert "--shard 1/2 chose 4 of 8 test cases" in parts[0].message
    # With what the first one left here, the second one has everything.
    assert parts[1].exit_code is ExitCode.OK
    small.run(db="whole.db")
    assert table_hash(small.db) == table_hash(small.folder / "whole.db")


@pytest.mark.slow
def test_what_is_not_chosen_is_not_run_and_what_is_chosen_counts(small: Project) -> None:
    fails_for_the_candidate(small)
    summary = run(small, **word("gap=30"))
    assert (summary.executed, summary.selected, summary.to_execute) == (4, 4, 4)
    # A failure in the part is a failure, though the rest was not run.
    assert summary.exit_code is ExitCode.FAILED
    verdicts = {(line.architecture, line.fsr): line.verdict for line in summary.verdicts}
    assert verdicts["camera_radar", "FSR-06"] is Verdict.FAIL
    assert verdicts["camera_radar", "FSR-01"] is Verdict.NOT_RUN
    assert "4 of 8 test cases accounted for" in summary.message
    rest = small.run()
    assert (rest.executed, rest.reused) == (4, 4)
    with Repository.open(small.db, create=False) as repository:
        assert repository.verify() == ()


@pytest.mark.slow
def test_chosen_passes_are_no_success(small: Project) -> None:
    summary = run(small, **word("camera_radar and gap=50"))
    assert summary.exit_code is ExitCode.INCOMPLETE
    assert {line.verdict for line in summary.verdicts if line.is_gate and line.mandatory} == {
        Verdict.NOT_RUN
    }


@pytest.mark.slow
def test_empty_selection_is_no_success_even_where_all_is_done(small: Project) -> None:
    assert small.run().exit_code is ExitCode.OK
    summary = run(small, **word("no_such_name"))
    assert (summary.exit_code, summary.executed) == (ExitCode.INCOMPLETE, 0)
    assert "an empty selection is no success" in summary.message


@pytest.mark.slow
def test_last_failed_executes_after_an_edit_what_failed_before_it(small: Project) -> None:
    first = small.run()
    failed = {row["ordinal"] for row in small.rows() if "FAIL" in row["verdicts"].values()}
    assert 0 < len(failed) < 8
    with small.edited_odd() as odd:
        odd["seed"] = 8
    summary = run(small, choice=Choice(last_failed=True))
    assert summary.campaign != first.campaign
    assert (summary.executed, summary.selected) == (len(failed), len(failed))
    assert {row["ordinal"] for row in small.rows()} == failed


@pytest.mark.slow
def test_enough_failures_begin_no_further_block(
    small: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    fails_for_the_candidate(small)
    monkeypatch.setattr(runner, "block_size", lambda _: 1)
    summary = run(small, **word("camera_radar"), limits=Limits(most_failures=2))
    assert summary.executed == 2
    assert summary.exit_code is ExitCode.FAILED
    assert "ended early, 2 runs with a FAIL or an ERROR" in summary.message
    assert "6 test cases remain, the same command goes on" in summary.message
    assert small.run().executed == 6


@pytest.mark.slow
def test_budget_that_is_over_leaves_the_rest_for_the_next_time(small: Project) -> None:
    summary = run(small, limits=Limits(budget_s=1e-9))
    assert (summary.executed, summary.exit_code) == (0, ExitCode.INCOMPLETE)
    assert "the time that --budget gives is over; 8 test cases remain" in summary.message
    # A budget that is enough is not mentioned.
    done = run(small, limits=Limits(budget_s=1e6))
    assert (done.executed, done.exit_code) == (8, ExitCode.OK)
    assert "budget" not in done.message


@pytest.mark.slow
def test_runner_waits_for_what_others_execute_and_takes_it_over(
    small: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "block_size", lambda _: 1)
    monkeypatch.setattr(runner, "POLL_S", 0.0)
    plan = small.plan()
    phases: list[str] = []
    with Repository.open(small.db) as repository:
        stored = repository.plan_campaign(plan.record(), plan.planned(), block_size=1)
        held: list[Block | None] = [repository.claim_block(FAR, 1e6, campaign=stored.campaign)]

        def tell(state: Progress) -> None:
            phases.append(state.phase)
            if phases.count("wait") == 3 and held[0] is not None:
                # The other one gives it back: it is not lost to this one.
                assert repository.release_block(held[0])
                held[0] = None

        summary = run_campaign(plan, db=small.db, progress=tell)
    assert phases.count("wait") == 3
    assert (summary.executed, summary.exit_code) == (8, ExitCode.OK)
    assert count_rows(small.db, "run") == 8


@pytest.mark.slow
def test_runner_that_does_not_want_it_does_not_wait_for_it(small: Project) -> None:
    plan = small.plan()
    with Repository.open(small.db) as repository:
        stored = repository.plan_campaign(plan.record(), plan.planned(), block_size=2)
        block = repository.claim_block(FAR, 1e6, campaign=stored.campaign)
        assert block is not None
        name = next(
            case.architecture
            for ordinal, case, _ in repository.queue.cases(stored.campaign)
            if ordinal == block.cases[0].ordinal
        )
    summary = run(small, **word(f"not {name}"))
    assert summary.executed == 4
