"""Programs as channels in a whole campaign: outcomes, equal bits, replay, identity."""

from pathlib import Path
from typing import Any

import pytest

from adeye.campaign import run as runner
from adeye.campaign.replay import replay_run
from adeye.errors import UsageError
from adeye.simulate.channels.process.channel import MOST_PROGRAMS
from adeye.testing import feed, zoo
from tests.conftest import MakeProject
from tests.motorway import cut_ins
from tests.project import CANDIDATE, Project, table_hash

ANIMALS = ("segfaults", "sleeps", "raises", "says_nan")


def guest(name: str) -> dict[str, Any]:
    links = ["localisation", "channels.nominal"]
    content = zoo.parameters(name)
    return {"kind": "process", "links": links, "rate": "20 Hz", "parameters": content}


def add(project: Project, architecture: str, name: str = "") -> None:
    """Write an architecture with a guest and name it in the ODD."""
    path = f"architectures/{architecture}.yaml"
    names = {"extends": "camera_radar.yaml", "architecture": architecture, "title": architecture}
    project.write(f"odd/{path}", {**names, "channels": {"guest": guest(name)}})
    with project.edited_odd() as odd:
        odd["architectures"] = list(dict.fromkeys([*odd["architectures"], path]))


@pytest.fixture
def project(make_project: MakeProject) -> Project:
    made = make_project(cut_ins("guests", "30 m", "50 m"))
    zoo.settle(made.folder / "odd" / "architectures")
    add(made, "honest")
    return made


def digests(project: Project, db: str = "") -> dict[tuple[str, str], str]:
    return {
        (row["architecture"], str(row["parameters"])): row["trace_digest"]
        for row in project.rows(db=db)
    }


@pytest.mark.slow
def test_failing_programs_are_named_and_no_other_run_changes(project: Project) -> None:
    project.run(db="honest.db")
    for name in ANIMALS:
        add(project, name, name)
    summary = project.run()
    rows = project.rows()
    assert len(rows) == 2 * (2 + len(ANIMALS))
    for row in rows:
        name = row["architecture"]
        animal = zoo.ANIMALS.get(name, zoo.Animal(zoo.COMPLETED))
        assert row["outcome"] == animal.outcome
        assert bool(row["machine_dependent"]) == animal.is_machine_dependent
        if name in ANIMALS:
            assert row["outcome_channel"] == "guest"
            # What is mastered passes: the guest has no authority.
            assert row["verdicts"]["FSR-01"] == "PASS"
    assert "channel_killed of channel guest in 2 runs of segfaults" in summary.message
    assert digests(project, "honest.db").items() <= digests(project).items()
    hanging = next(row["run"] for row in rows if row["architecture"] == "sleeps")
    assert "depends on the machine" in replay_run(project.db, hanging).note


@pytest.mark.slow
def test_blocks_and_workers_make_no_difference(
    project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    add(project, "raises", "raises")
    project.run()
    monkeypatch.setattr(runner, "block_size", lambda _: 1)
    project.run(db="other.db", workers=2)
    assert table_hash(project.db) == table_hash(project.folder / "other.db")


@pytest.mark.slow
def test_edited_program_is_executed_again_and_nothing_else(project: Project) -> None:
    project.run()
    assert project.run().executed == 0
    with (project.folder / "odd" / "architectures" / "zoo.py").open("a") as stream:
        stream.write("# edited\n")
    assert project.run().executed == 2


@pytest.mark.slow
def test_values_can_be_swept(project: Project) -> None:
    with project.edited_odd() as odd:
        path = "architecture.channels.guest.parameters.values.animal"
        odd["scenarios"][0]["sweep"]["parameters"] = {"gap": ["30 m"], path: ["", "raises"]}
    project.run()
    outcomes = {row["outcome"] for row in project.rows() if row["architecture"] == "honest"}
    assert outcomes == {"completed", "channel_error"}


@pytest.mark.slow
def test_blocks_hold_no_more_programs_than_a_machine_can_bear(project: Project) -> None:
    with project.edited_odd() as odd:
        gaps = {"from": "10 m", "to": "60 m", "step": "0.01 m"}
        odd["scenarios"][0]["sweep"]["parameters"] = {"gap": gaps}
    assert runner.block_size(project.plan()) == MOST_PROGRAMS
    with project.edited("odd/architectures/honest.yaml") as honest:
        honest["channels"]["second"] = guest("")
    assert runner.block_size(project.plan()) == MOST_PROGRAMS // 2
    assert not project.plan().is_compiled


@pytest.mark.slow
def test_non_deterministic_program_is_caught_by_a_replay(project: Project) -> None:
    add(project, "reads_the_clock", "reads_the_clock")
    project.run()
    run = next(row["run"] for row in project.rows() if row["architecture"] == "reads_the_clock")
    assert not replay_run(project.db, run).identical


@pytest.mark.slow
def test_what_a_stored_run_showed_is_saved_and_fed(project: Project, tmp_path: Path) -> None:
    project.run()
    run = next(row["run"] for row in project.rows() if row["architecture"] == "honest")
    file = tmp_path / "shown.jsonl"
    replayed = replay_run(project.db, run, ("guest", file))
    assert replayed.identical
    fed = list(feed("process", file, folder=(project.folder / CANDIDATE).parent))
    assert len(fed) == replayed.rows - 1
    assert {item.failure for item in fed} == {None}
    with pytest.raises(UsageError, match="has no channel 'gest'") as caught:
        replay_run(project.db, run, ("gest", file))
    assert "guest" in caught.value.remedy
    with pytest.raises(UsageError, match="is a database"):
        replay_run(project.db, run, ("guest", project.db))
