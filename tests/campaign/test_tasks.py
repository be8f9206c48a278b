"""Blocks on their way: pieces together, failures apart, limits before they begin."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.campaign.run import Limits, Session, Tasks
from adeye.campaign.work import execute
from adeye.store.owner import Owner
from adeye.store.repository import Repository
from tests.project import MINI, Project, table_hash

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from adeye.store.records import Plan
    from tests.conftest import MakeProject

GAPS: dict[str, Any] = {
    **MINI,
    "scenarios": [
        {
            "use": "cut_in",
            "faults": ["none"],
            "sweep": {"parameters": {"gap": ["30 m", "35 m", "40 m", "45 m", "50 m", "55 m"]}},
        }
    ],
    "faults": [],
    "architectures": ["architectures/camera_radar.yaml"],
}
"""Six test cases of one structure, so of one block."""


@pytest.fixture
def project(make_project: MakeProject) -> Project:
    return make_project(GAPS)


@pytest.fixture
def repository(project: Project) -> Iterator[Repository]:
    with Repository.open(project.db) as opened:
        yield opened


@pytest.fixture
def make(project: Project, repository: Repository) -> Callable[..., Tasks]:
    plan = project.plan()

    def tasks(*ordinals: int, session: Session | None = None) -> Tasks:
        stored: Plan = repository.plan_campaign(plan.record(), plan.planned(), block_size=6)
        made = Tasks(repository, plan, stored, (True, True), session or Session())
        chosen = np.zeros(6, dtype=np.bool_)
        chosen[list(ordinals)] = True
        made.choose(chosen if ordinals else None, stored, 6)
        return made

    return tasks


@pytest.mark.slow
def test_pieces_of_a_block_are_executed_together_and_completed_apart(
    make: Callable[..., Tasks], project: Project, repository: Repository
) -> None:
    tasks = make(0, 2, 5)
    (task,) = list(tasks)
    assert len(task.execute) == 3
    assert len(tasks.held()) == 3
    assert tasks.complete(task, execute(task)) == 3
    assert (tasks.executed, tasks.held()) == (3, [])
    campaign = repository.find_campaign()
    assert campaign.work.done == 3
    # The rest is in pieces too, and comes as one task.
    rest = make()
    for other in rest:
        rest.complete(other, execute(other))
    assert repository.verify() == ()
    project.run(db="whole.db")
    assert table_hash(project.db) == table_hash(project.folder / "whole.db")


@pytest.mark.slow
def test_rest_in_pieces_is_executed_together_if_all_of_it_is_chosen(
    make: Callable[..., Tasks],
) -> None:
    tasks = make(1, 3)
    (task,) = list(tasks)
    tasks.complete(task, execute(task))
    (rest,) = list(make(*range(6)))
    assert len(rest.execute) == 4


def test_pieces_that_failed_are_tried_one_by_one(
    make: Callable[..., Tasks], repository: Repository
) -> None:
    tasks = make(0, 2, 5)
    tasks.fail(next(tasks), "broken")
    assert tasks.held() == []
    assert [len(task.execute) for task in tasks] == [1, 1, 1]
    tasks.release()
    assert tasks.failures == ["broken"]
    assert repository.find_campaign().work.leased == 0


@pytest.mark.slow
def test_piece_that_was_taken_over_does_not_count_and_the_others_do(
    make: Callable[..., Tasks], repository: Repository
) -> None:
    tasks = make(0, 2, 5)
    task = next(tasks)
    lost = tasks.held()[1]
    assert repository.release_block(lost)
    other = Owner("another machine", 1, "1")
    assert repository.claim_block(other, 1e6, campaign=lost.campaign) is not None
    assert tasks.complete(task, execute(task)) == 2
    assert (tasks.executed, tasks.dropped) == (2, 1)
    assert "1 block had been taken over" in tasks.notes(0)[-1]


def test_block_for_which_there_is_no_time_is_given_back(
    make: Callable[..., Tasks], repository: Repository
) -> None:
    limits = Limits(budget_s=100.0)
    limits.measure(1, 99.0)
    tasks = make(session=Session(limits=limits))
    assert list(tasks) == []
    assert repository.find_campaign().work.leased == 0
    (note,) = tasks.notes(6)
    assert "6 test cases remain, the same command goes on" in note


def test_nothing_is_claimed_when_somebody_asked_for_the_end(
    make: Callable[..., Tasks], repository: Repository
) -> None:
    session = Session()
    session.stop.asked = KeyboardInterrupt
    assert list(make(session=session)) == []
    assert repository.find_campaign().work.leased == 0


def test_release_gives_back_what_was_not_completed(
    make: Callable[..., Tasks], repository: Repository
) -> None:
    tasks = make(0, 2)
    assert next(tasks, None) is not None
    assert repository.find_campaign().work.leased == 2
    tasks.release()
    assert repository.find_campaign().work.leased == 0


def test_others_are_met_where_they_hold_something(
    make: Callable[..., Tasks], repository: Repository
) -> None:
    tasks = make()
    task = next(tasks)
    assert (tasks.open_elsewhere(), tasks.met_others) == (0, False)
    tasks.release()
    assert repository.claim_block(Owner("another machine", 1, "1"), 1e6) is not None
    assert len(task.execute) == 6
    assert (tasks.open_elsewhere(), tasks.met_others) == (6, True)
