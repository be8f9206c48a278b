"""Stored runs: shown, recalled part by part, and executed again."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from adeye.answers import describe_run
from adeye.campaign import replay as recalling
from adeye.campaign.replay import Counter, recalled_parts, replay_run, rerun, together
from adeye.campaign.run import Progress, run_campaign
from adeye.campaign.studies import forks as takeovers
from adeye.campaign.studies.fault_timing import campaign_injections
from adeye.campaign.studies.forks import look_back
from adeye.errors import InputError
from adeye.simulate import engine
from adeye.store.repository import Repository
from adeye.sweep.case import structure_key
from tests.project import Executed
from tests.refusals import refused

# --- a stored run, shown and executed again


@pytest.fixture
def row(mini: Executed) -> dict[str, object]:
    """A run whose nominal channel falls silent."""
    return next(row for row in mini.project.rows() if row["fault_entry"] == "nominal_silent")


def test_replay_gives_the_stored_bits(mini: Executed, row: dict[str, object]) -> None:
    replayed = replay_run(mini.db, str(row["run"])[:12])
    assert replayed.identical
    assert replayed.trace_digest == replayed.stored_digest == row["trace_digest"]
    assert (replayed.run, replayed.note) == (row["run"], "")
    assert replayed.fault_entry == "nominal_silent"
    assert dict(replayed.verdicts) == row["verdicts"]


def test_another_numerics_version_is_named_as_the_reason(
    mini: Executed, row: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine, "NUMERICS_VERSION", engine.NUMERICS_VERSION + 1)
    assert "numerics version" in replay_run(mini.db, str(row["run"])).note


def test_execution_brings_everything(mini: Executed, row: dict[str, object]) -> None:
    with Repository.open(mini.db, create=False) as repository:
        done = rerun(repository, repository.find_run(str(row["run"])))
    assert done.trace.runs == 1
    assert "authority.safety" in done.signals.dictionary
    judged = {item.fsr_id: item.verdict.value for item in done.evaluation.judgements[0]}
    assert judged == row["verdicts"]


def test_description_holds_everything_about_a_run(mini: Executed, row: dict[str, object]) -> None:
    found = describe_run(mini.db, str(row["run"])[:12])
    assert found["is_done"] is True
    assert found["parameters"]["gap"] in {"30 m", "50 m"}
    assert found["swept_paths"] == {}
    assert found["command"] == f"adeye replay {str(row['run'])[:12]} --db {mini.db}"
    assert {item["fsr"]: item["verdict"] for item in found["verdicts"]} == row["verdicts"]
    assert found["metrics"]["min_distance_m"]["value"] == row["min_distance_m"]
    assert any("nominal_silent" in item["text"] for item in found["events"])


def test_planned_run_has_a_description_but_no_replay(mini: Executed, tmp_path: Path) -> None:
    db = tmp_path / "adeye.db"
    with pytest.raises(KeyboardInterrupt):
        run_campaign(mini.plan, db=db, progress=Mock(side_effect=KeyboardInterrupt))
    first = next(iter(mini.plan.planned()))
    run = first.engine.result_digest(first.test_cases[0])
    assert describe_run(db, run)["is_done"] is False
    refused(InputError, replay_run, db, run, says="planned, but not executed yet")


def test_run_and_database_that_are_not_there(mini: Executed, tmp_path: Path) -> None:
    for db, run in ((mini.db, "0123456789ab"), (tmp_path / "missing.db", "a")):
        refused(InputError, replay_run, db, run)
    assert list(tmp_path.iterdir()) == []


# --- recalled runs of the mini campaign, part by part, and who is told how many are done


def recalled(mini: Executed) -> list[Any]:
    """Recall every run of the campaign, part by part."""
    with Repository.open(mini.db, create=False) as repository:
        runs = repository.hindsight.executed(repository.find_campaign().id)
        return list(recalled_parts(repository, runs))


def test_parts_hold_every_run_once(mini: Executed, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recalling, "PART_RUNS", 10)
    parts = recalled(mini)
    assert [len(part) for part in parts] == [10, 10, 8]
    assert [item.run.ordinal for part in parts for item in part] == list(range(28))


def test_together_is_one_structure(mini: Executed, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recalling, "MOST_TOGETHER", 3)
    (part,) = recalled(mini)
    batches = list(together(part, lambda item: item))
    assert max(map(len, batches)) == 3
    assert sum(map(len, batches)) == 28
    for batch in batches:
        assert len({structure_key(item.case) for item in batch}) == 1


def test_counter_tells_each_time_how_many_are_done() -> None:
    told: list[Progress] = []
    counter = Counter("forks", 5, told.append)
    counter.add(2)
    counter.add(3)
    assert [(item.done, item.total) for item in told] == [(0, 5), (2, 5), (5, 5)]
    assert {item.phase for item in told} == {"forks"}
    Counter("forks", 5, None).add(1)


@pytest.mark.slow
def test_looking_back_in_small_parts_finds_the_same_and_tells_how_far_it_is(
    mini: Executed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copyfile(mini.db, tmp_path / "whole.db")
    shutil.copyfile(mini.db, tmp_path / "parts.db")
    whole = look_back(tmp_path / "whole.db"), campaign_injections(tmp_path / "whole.db")
    monkeypatch.setattr(recalling, "PART_RUNS", 9)
    told: list[Progress] = []
    forks = look_back(tmp_path / "parts.db", report=told.append)
    assert (told[0].done, told[-1].done, told[-1].total) == (0, 28, 28)
    assert [item.done for item in told] == sorted(item.done for item in told)
    told.clear()
    faults = campaign_injections(tmp_path / "parts.db", report=told.append)
    assert told[-1].done == told[-1].total == faults.looked_at > 0
    assert (forks, faults) == whole


@pytest.mark.slow
def test_what_was_done_is_kept(
    mini: Executed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    db = tmp_path / "adeye.db"
    shutil.copyfile(mini.db, db)
    monkeypatch.setattr(recalling, "PART_RUNS", 9)

    def interrupt(progress: Progress) -> None:
        if progress.done:
            raise KeyboardInterrupt

    refused(KeyboardInterrupt, look_back, db, report=interrupt)
    told: list[Progress] = []
    assert look_back(db, report=told.append).looked_at == 28
    assert 0 < told[0].total < 28
    assert takeovers.look_back(db).looked_at == 28
