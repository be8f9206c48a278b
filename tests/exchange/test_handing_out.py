"""Stored runs are executed again and handed to other people's viewers, wholly or not at all."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from adeye.campaign.replay import Execution, rerun
from adeye.campaign.work import WorkContext
from adeye.errors import InputError, IntegrityError, UsageError
from adeye.judge.verdict import Verdict
from adeye.reporting import export_osi, handing_out, verdicts_of
from adeye.store.write.studies import Hindsight
from adeye.sweep.case import TestCase
from adeye.trace import Trace
from tests.exchange.foxglove_rules import findings
from tests.exchange.test_mcap import read
from tests.exchange.test_osi import read as read_osi
from tests.project import Executed
from tests.refusals import refused


@pytest.fixture(scope="module")
def done(mini: Executed) -> Execution:
    """A run in which a fault made the architecture hand over."""
    with mini.opened() as (repository, campaign):
        rows = repository.results(campaign.id)
        runs = [dict(zip(rows.columns, row, strict=True)) for row in rows.rows]
        faulty = next(row for row in runs if row["fault_entry"] != "none")
        return rerun(repository, repository.find_run(faulty["run"]))


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_run_is_written_in_every_form(done: Execution, tmp_path: Path) -> None:
    names = {"mcap": "r.mcap", "osi": "osi", "commonroad": "cr"}
    places: dict[str, Any] = {form: tmp_path / name for form, name in names.items()}
    handing_out(**places)(done)
    assert findings(places["mcap"]) == []
    found = read(places["mcap"])
    assert len(found["/scene"]) == int(done.trace.length[0])
    said = [(log.name, log.message) for _, log in found["/events"]]
    for event in done.stored.events:
        assert (event.subject or event.kind, event.text) in said
    verdicts = {name: text.partition(":")[0] for name, text in said if name.startswith("FSR")}
    assert verdicts == {item.fsr_id: item.verdict.value for item in verdicts_of(done)}
    levels = {log.name: log.level for _, log in found["/events"]}
    for item in verdicts_of(done):
        assert (levels[item.fsr_id] == 4) == (item.verdict in {Verdict.FAIL, Verdict.ERROR})
    metrics = done.stored.metrics
    ((_, told),) = found["/metrics"]
    assert told == {name: item.value for name, item in metrics.items() if item.value is not None}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cr", "osi", "r.mcap"]
    assert len(contents(places["commonroad"])) == 2
    assert len(read_osi(places["osi"], "GroundTruth")) == int(done.trace.length[0])
    first = contents(places["osi"])
    handing_out(osi=places["osi"])(done)
    assert contents(places["osi"]) == first


def test_campaign_is_exported_run_by_run(mini: Executed, done: Execution, tmp_path: Path) -> None:
    run = done.run.result_digest
    assert export_osi(mini.db, None, tmp_path / "out", [run[:12], run[:12]]) == 1
    handing_out(osi=tmp_path / "one")(done)
    assert contents(tmp_path / "out") == contents(tmp_path / "one")


def test_runs_are_executed_together_and_counted(
    mini: Executed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sizes: list[int] = []
    drive = WorkContext.drive

    def count(self: WorkContext, cases: Sequence[TestCase], **how: Any) -> Trace:
        sizes.append(len(cases))
        return drive(self, cases, **how)

    monkeypatch.setattr(WorkContext, "drive", count)
    with mini.opened() as (repository, campaign):
        runs = repository.hindsight.executed(campaign.id)
        names = [run.result_digest for run in runs if run.scenario == runs[0].scenario][:5]
        alone = [rerun(repository, repository.find_run(name)) for name in names]
    told: list[tuple[str, int, int]] = []
    export_osi(
        mini.db,
        None,
        tmp_path / "out",
        names,
        report=lambda state: told.append((state.phase, state.done, state.total)),
    )
    assert told == [("replay", done, 5) for done in range(6)]
    assert max(sizes[5:]) > 1
    assert sum(sizes[5:]) == 5
    wanted: dict[str, bytes] = {}
    for number, item in enumerate(alone):
        handing_out(osi=tmp_path / f"one{number}")(item)
        wanted |= contents(tmp_path / f"one{number}")
    assert contents(tmp_path / "out") == wanted


@pytest.mark.slow
def test_all_runs_of_a_campaign_are_exported(mini: Executed, tmp_path: Path) -> None:
    assert export_osi(mini.db, "1", tmp_path / "out") == 28
    truths = [path for path in (tmp_path / "out").iterdir() if "_gt_" in path.name]
    assert len(truths) == 28


def test_folder_of_something_else_is_refused_before_anything_is_done(
    mini: Executed, tmp_path: Path
) -> None:
    (tmp_path / "thesis.tex").write_text("mine")
    for act in (
        lambda: handing_out(osi=tmp_path),
        lambda: handing_out(commonroad=tmp_path),
        lambda: export_osi(mini.db, None, tmp_path),
        lambda: export_osi(mini.db, None, mini.db.parent),
    ):
        with pytest.raises(UsageError, match="holds something else"):
            act()
    assert contents(tmp_path) == {"thesis.tex": b"mine"}


@pytest.mark.parametrize("form", ["osi", "commonroad"])
def test_folder_of_that_form_by_somebody_else_is_refused(
    done: Execution, tmp_path: Path, form: str
) -> None:
    given: dict[str, Any] = {form: tmp_path / form}
    handing_out(**given)(done)
    for path in (tmp_path / form).iterdir():
        content = path.read_bytes()
        other = content.replace(b"adeye", b"drawn").replace(b"1970-", b"2020-")
        if other != content:
            path.write_bytes(other)
            with pytest.raises(UsageError, match="that adeye has not written"):
                handing_out(**given)
            path.write_bytes(content)
    handing_out(**given)(done)


@pytest.mark.parametrize(
    ("package", "asked", "extra"),
    [
        ("foxglove", "mcap", "viz"),
        ("mcap", "mcap", "viz"),
        ("osi3", "osi", "osi"),
        ("rosbags", "rosbag", "viz"),
    ],
)
def test_missing_extra_is_told_before_anything_is_done(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, package: str, asked: str, extra: str
) -> None:
    for name in [*sys.modules]:
        if name.partition(".")[0] == package or name.startswith("adeye.exchange."):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(InputError, match=rf"needs adeye\[{extra}\]"):
        handing_out(**dict[str, Any]({asked: tmp_path / "out"}))


def test_running_a_campaign_loads_no_library_of_viewers() -> None:
    script = (
        "import sys, adeye.cli.run, adeye.campaign.run, adeye.campaign.work, adeye.reporting\n"
        "print(sorted({'foxglove', 'mcap', 'osi3', 'google'} & set(sys.modules)))"
    )
    assert subprocess.check_output([sys.executable, "-c", script], text=True).strip() == "[]"


def test_run_that_comes_out_otherwise_is_not_exported(
    mini: Executed, done: Execution, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = done.run.result_digest
    monkeypatch.setattr(Trace, "digests", lambda self: ["0" * 64] * self.runs)
    says = "does not come out as it was recorded"
    refused(IntegrityError, export_osi, mini.db, None, tmp_path / "out", [run], says=says)
    assert not (tmp_path / "out").exists()


def test_campaign_without_a_result_replaces_no_traces(
    mini: Executed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Hindsight, "executed", lambda *_: [])
    says = "no run of the campaign has a result"
    refused(InputError, export_osi, mini.db, None, tmp_path / "out", says=says)
    assert not (tmp_path / "out").exists()
