"""``timeline`` and ``faults``: what is printed of what follows a fault."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING, Any

import pytest

from tests.noisy import CONFIRM, noisy_project

if TYPE_CHECKING:
    from pathlib import Path

    from tests.project import Executed


@pytest.fixture
def run(mini: Executed) -> str:
    """A run of the candidate whose nominal channel falls silent."""
    return next(
        str(row["run"])
        for row in mini.project.rows()
        if (row["architecture"], row["fault_entry"]) == ("camera_radar", "nominal_silent")
    )


def test_timeline_prints_moments_and_intervals(adeye: Any, mini: Executed, run: str) -> None:
    done = adeye("timeline", run[:12], "--db", str(mini.db))
    assert done.code == 0, done.err
    for word in ("detected_in_time", "FDTI", "FRTI", "FHTI", "FTTI", "safe state"):
        assert word in done.out


@pytest.mark.slow
def test_intervals_add_up_in_json(adeye: Any, mini: Executed, run: str) -> None:
    found = adeye("timeline", run, "--db", str(mini.db), "--json").document
    assert found["fhti_s"] == pytest.approx(found["fdti_s"] + found["frti_s"])
    assert found["margin_s"] == pytest.approx(found["ftti_s"] - found["fhti_s"])
    assert found["class_"] == "detected_in_time"


def test_run_without_a_fault_is_a_usage_error(adeye: Any, mini: Executed) -> None:
    run = next(str(row["run"]) for row in mini.project.rows() if row["fault_entry"] == "none")
    done = adeye("timeline", run, "--db", str(mini.db))
    assert done.code == 2
    assert "no fault" in done.err


@pytest.mark.slow
def test_faults_count_by_scenario_fault_and_architecture(
    adeye: Any, mini: Executed, tmp_path: Path
) -> None:
    db = shutil.copyfile(mini.db, tmp_path / "adeye.db")
    done = adeye("faults", "--sample", "0", "--db", str(db))
    assert done.code == 0, done.err
    assert "16 runs with faults" in done.out
    assert "%" not in done.out
    document = adeye("faults", "--sample", "0", "--db", str(db), "--json").document
    assert len(document["injections"]) == 16
    assert {row["coverage"] for row in document["rows"]} == {None}


@pytest.mark.slow
def test_faults_leave_out_classes_that_are_not_there_on_a_narrow_terminal(
    adeye: Any, mini: Executed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    db = shutil.copyfile(mini.db, tmp_path / "adeye.db")
    rows = adeye("faults", "--sample", "0", "--db", str(db), "--json").document["rows"]
    monkeypatch.setenv("COLUMNS", "120")
    printed = adeye("faults", "--sample", "0", "--db", str(db)).out
    assert "Not activated" not in printed
    assert max(map(len, printed.splitlines())) <= 120
    (row, *_) = [row for row in rows if row["counts"]["detected_in_time"]]
    assert f"{row['counts']['detected_in_time']} in time" in printed


@pytest.mark.slow
def test_trade_of_an_axis_is_a_table_and_json(
    adeye: Any, tmp_path_factory: pytest.TempPathFactory
) -> None:
    project = noisy_project(tmp_path_factory.mktemp("noisy"))
    project.run()
    done = adeye("faults", "--by", "safety.parameters.confirm", "--db", str(project.db))
    assert done.code == 0, done.err
    assert CONFIRM in done.out
    assert "8 of 8" in done.out
    document = adeye("faults", "--by", CONFIRM, "--db", str(project.db), "--json").document
    [curve] = document["curves"]
    assert [point["value"] for point in curve["points"]] == ["0 s", "0.1 s", "0.2 s"]


def test_axis_that_is_not_swept_is_a_usage_error(adeye: Any, mini: Executed) -> None:
    done = adeye("faults", "--by", "confirm", "--db", str(mini.db))
    assert done.code == 2
    assert "does not sweep" in done.err
