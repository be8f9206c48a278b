"""A stored run, shown and executed again."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from adeye.campaign.replay import describe_run, replay_run, rerun
from adeye.campaign.run import Progress, run_campaign
from adeye.errors import InputError
from adeye.simulate import engine
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from pathlib import Path

    from tests.project import Executed


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


def test_execution_brings_trace_signals_and_judgements(
    mini: Executed, row: dict[str, object]
) -> None:
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
    def stop(_: Progress) -> None:
        raise KeyboardInterrupt

    db = tmp_path / "adeye.db"
    with pytest.raises(KeyboardInterrupt):
        run_campaign(mini.plan, db=db, progress=stop)
    first = next(iter(mini.plan.planned()))
    run = first.engine.result_digest(first.test_cases[0])
    assert describe_run(db, run)["is_done"] is False
    with pytest.raises(InputError, match="planned, but not executed yet"):
        replay_run(db, run)


def test_unknown_run_is_an_input_error(mini: Executed) -> None:
    with pytest.raises(InputError):
        replay_run(mini.db, "0123456789ab")


def test_database_that_is_not_there_is_not_made(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        replay_run(tmp_path / "missing.db", "a")
    assert list(tmp_path.iterdir()) == []
