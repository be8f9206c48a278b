"""``fork``, ``forks``, ``timeline`` and ``faults``."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from adeye.campaign.studies import forks
from adeye.cli import progress
from adeye.errors import IntegrityError
from tests.noisy import CONFIRM, noisy_project
from tests.project import Executed

# --- ``fork`` and ``forks``: what is printed, and which exit code an untrue prefix has


@pytest.fixture
def db(folder: Path, mini: Executed) -> str:
    """A copy of the mini campaign, which may be written to."""
    shutil.copyfile(mini.db, folder / "adeye.db")
    shutil.copyfile(mini.db, folder / "adeye.db.before")
    return str(folder / "adeye.db")


@pytest.fixture
def run(mini: Executed) -> str:
    """A run of the candidate whose nominal channel falls silent."""
    return next(
        str(row["run"])
        for row in mini.project.rows()
        if (row["architecture"], row["fault_entry"]) == ("camera_radar", "nominal_silent")
    )


@pytest.mark.slow
def test_fork_prints_both_sides(adeye: Any, db: str, run: str) -> None:
    done = adeye("fork", run[:12], "--from", "2 s", "--authority", "safety", "--db", db).ok
    assert "safety from tick 40, 2 s" in done.out
    assert "FSR-01" in done.out
    assert "0 links" not in done.out
    assert "shorter than one link of the digest chain (100 ticks)" in " ".join(done.out.split())
    fork = next(line.split()[1] for line in done.out.splitlines() if line.startswith("Fork"))
    shown = adeye("show", fork[:12], "--db", db, "--json").document
    assert (shown["fork_of"], shown["from_tick"], shown["authority"]) == (run, 40, "safety")


@pytest.mark.slow
def test_fork_as_json_and_a_prefix_of_one_link(adeye: Any, db: str, run: str) -> None:
    arguments = ("fork", run, "--from", "150", "--authority", "safety", "--db", db)
    document = adeye(*arguments, "--json").document
    assert document["origin"]["run"] == run
    assert document["fork"]["run"] != run
    assert (document["from_tick"], document["links"]) == (150, 1)
    assert "150 ticks as recorded, 1 link of the digest chain" in adeye(*arguments).out


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments", [("forks", "--sample", "4"), ("faults", "--sample", "12"), ("timeline", "RUN")]
)
def test_progress_is_shown_on_a_terminal_only_and_never_when_quiet(
    adeye: Any, db: str, run: str, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...]
) -> None:
    words = [run if word == "RUN" else word for word in arguments]
    shown: list[tuple[int, int]] = []

    @contextmanager
    def bar() -> Iterator[Any]:
        yield lambda progress: shown.append((progress.done, progress.total))

    monkeypatch.setattr(progress, "_bar", bar)
    done = adeye(*words, "--db", db)
    assert (done.code, done.err, shown) == (0, "", [])
    monkeypatch.setattr(progress, "is_live", lambda: True)
    assert adeye(*words, "--db", db, "--quiet").code == 0
    assert shown == []
    # As it was before anybody looked back.
    shutil.copyfile(f"{db}.before", db)
    assert adeye(*words, "--db", db).code == 0
    assert shown[0][0] == 0
    assert shown[-1][0] == shown[-1][1] > 0


def test_altered_prefix(adeye: Any, db: str, run: str, monkeypatch: pytest.MonkeyPatch) -> None:
    refuse = Mock(side_effect=IntegrityError("the fork differs before its tick"))
    monkeypatch.setattr(forks, "_require_same_prefix", refuse)
    done = adeye("fork", run, "--from", "40", "--authority", "safety", "--db", db)
    assert done.code == 4
    assert "differs" in done.err


def test_unknown_channel_is_a_usage_error(adeye: Any, db: str, run: str) -> None:
    done = adeye("fork", run, "--from", "40", "--authority", "autopilot", "--db", db)
    assert "nominal, safety" in done.refused


@pytest.mark.slow
def test_forks_count_every_run_once(adeye: Any, db: str) -> None:
    assert "5 of 28 runs forked" in adeye("forks", "--sample", "5", "--db", db).ok.out
    document = adeye("forks", "--sample", "5", "--db", db, "--json").document
    assert sum(document["counts"].values()) == len(document["lines"]) == 5


# --- ``timeline`` and ``faults``: what is printed of what follows a fault


def test_timeline_prints_moments_and_intervals(adeye: Any, mini: Executed, run: str) -> None:
    done = adeye("timeline", run[:12], "--db", str(mini.db)).ok
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
    assert "no fault" in adeye("timeline", run, "--db", str(mini.db)).refused


@pytest.mark.slow
def test_faults_are_counted_and_classes_that_are_not_there_left_out_on_a_narrow_terminal(
    adeye: Any, db: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments = ("faults", "--sample", "0", "--db", db)
    done = adeye(*arguments).ok
    assert "16 runs with faults" in done.out
    assert "%" not in done.out
    document = adeye(*arguments, "--json").document
    assert len(document["injections"]) == 16
    assert {row["coverage"] for row in document["rows"]} == {None}
    monkeypatch.setenv("COLUMNS", "120")
    printed = adeye(*arguments).out
    assert "Not activated" not in printed
    assert max(map(len, printed.splitlines())) <= 120
    (count, *_) = filter(None, (row["counts"]["detected_in_time"] for row in document["rows"]))
    assert f"{count} in time" in printed


@pytest.mark.slow
def test_trade_of_an_axis(adeye: Any, tmp_path_factory: pytest.TempPathFactory) -> None:
    project = noisy_project(tmp_path_factory.mktemp("noisy"))
    project.run()
    done = adeye("faults", "--by", "safety.parameters.confirm", "--db", str(project.db)).ok
    assert CONFIRM in done.out
    assert "8 of 8" in done.out
    document = adeye("faults", "--by", CONFIRM, "--db", str(project.db), "--json").document
    [curve] = document["curves"]
    assert [point["value"] for point in curve["points"]] == ["0 s", "0.1 s", "0.2 s"]


def test_axis_that_is_not_swept_is_a_usage_error(adeye: Any, mini: Executed) -> None:
    assert "does not sweep" in adeye("faults", "--by", "confirm", "--db", str(mini.db)).refused
