"""``certify`` and ``selftest``."""

from __future__ import annotations

import json
import shutil
import sqlite3
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from adeye.campaign.studies import certify as certificate
from adeye.campaign.studies.certify import CONDITIONS
from adeye.cli import certify as verb
from adeye.cli.app import main
from adeye.judge.verdict import ExitCode
from adeye.selftest import running
from adeye.selftest.bench import Master, Seen

if TYPE_CHECKING:
    from pathlib import Path

    from tests.project import Executed


# --- ``certify`` on the command line: exit codes, tables and JSON


@pytest.fixture
def db(mini: Executed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(certificate, "CONDITIONS", CONDITIONS[1:3])
    copy = tmp_path / "mini.db"
    shutil.copyfile(mini.db, copy)
    return copy


@pytest.mark.slow
def test_deterministic_campaign_is_certified(
    db: Path, mini: Executed, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["certify", str(mini.project.odd), "--db", str(db), "--sample", "10", "--quiet"]
    assert main(arguments) == 0
    shown = capsys.readouterr().out
    assert "10 of 28 runs, from 8 combinations" in shown
    assert "batches of 7, reversed, in this process" in shown
    assert "Certified: every trace, metric and verdict" in shown


@pytest.mark.slow
def test_run_that_differs_is_exit_code_4_and_named(
    db: Path, mini: Executed, capsys: pytest.CaptureFixture[str]
) -> None:
    connection = sqlite3.connect(db)
    connection.execute("DROP TRIGGER run_no_update")
    connection.execute("UPDATE run SET trace_digest = 'other' WHERE number = 1")
    run = connection.execute("SELECT result_digest FROM run WHERE number = 1").fetchone()[0]
    connection.commit()
    connection.close()
    arguments = ["certify", str(mini.project.odd), "--db", str(db), "--quiet"]
    assert main(arguments) == 4
    shown = capsys.readouterr().out
    assert run[:10] in shown
    assert "every one" in shown
    assert "NOT CERTIFIED: 1 of 28 runs differ, in the same way under every condition" in shown
    assert main([*arguments, "--json"]) == 4
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "adeye/certify@1"
    assert document["certified"] is False
    assert [item["run"] for item in document["findings"]] == [run]


def test_unknown_campaign_is_an_input_error(db: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["certify", "ffff", "--db", str(db)]) == 2
    assert "ffff" in capsys.readouterr().err


# --- ``selftest``: exit code 4 names what was not found; only a complete one is kept


GOOD = Master(
    "good_one", "file", "w", "f", 2, "wrong", lambda _: Seen(2, "wrong"), lambda _: Seen(0, "")
)
BLIND = Master(
    "blind_one", "file", "w", "f", 2, "wrong", lambda _: Seen(0, ""), lambda _: Seen(0, "")
)


@pytest.fixture
def masters(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Take other masters than the real ones, which take their time."""

    def use(*chosen: Master) -> None:
        monkeypatch.setattr(running, "MASTERS", chosen)

    return use


@pytest.mark.slow
def test_real_master_by_name_is_detected_and_nothing_is_kept(adeye: Any, folder: Path) -> None:
    ended = adeye("selftest", "--only", "unit_missing")
    assert ended.code == 0, ended.err
    assert "1 of 1 detected" in ended.out
    assert verb.REMARK in ended.out
    assert list(folder.iterdir()) == []


def test_complete_self_test_is_kept_beside_the_database(
    adeye: Any, folder: Path, masters: Any
) -> None:
    masters(GOOD)
    assert adeye("selftest", "--quiet").code == 0
    kept = json.loads((folder / ".adeye" / "selftest.json").read_text("utf-8"))
    assert (kept["masters"], kept["detected"]) == (1, 1)
    assert adeye("selftest", "--db", "other/x.db").code == 0
    assert [path.name for path in (folder / "other").iterdir()] == ["selftest.json"]


def test_undetected_master_is_named_with_exit_code_4_and_kept(
    adeye: Any, folder: Path, masters: Any
) -> None:
    masters(GOOD, BLIND)
    ended = adeye("selftest")
    assert ended.code == ExitCode.INTEGRITY
    assert "blind_one" in ended.err
    assert "good_one" not in ended.err
    assert "NOT DETECTED" in ended.out
    kept = json.loads((folder / ".adeye" / "selftest.json").read_text("utf-8"))
    assert kept["undetected"] == ["blind_one"]


def test_rejected_twin_is_named_with_exit_code_4(adeye: Any, masters: Any) -> None:
    masters(Master("m", "file", "w", "f", 2, "x", lambda _: Seen(2, "x"), lambda _: Seen(1, "")))
    ended = adeye("selftest", "--quick")
    assert ended.code == ExitCode.INTEGRITY
    assert "REJECTED" in ended.out


def test_json_has_what_was_seen(adeye: Any, masters: Any) -> None:
    masters(GOOD, BLIND)
    document = adeye("selftest", "--json").document
    assert document["schema"] == "adeye/selftest@1"
    assert [item["is_detected"] for item in document["results"]] == [True, False]


def test_list_runs_nothing(adeye: Any, folder: Path) -> None:
    listed = adeye("selftest", "--list", "--json").document["masters"]
    assert [item["name"] for item in listed] == [item.name for item in running.MASTERS]
    assert "never_brakes" in adeye("selftest", "--list").out
    assert list(folder.iterdir()) == []


def test_unknown_master_is_an_input_error(adeye: Any) -> None:
    assert "Did you mean 'never_brakes'" in adeye("selftest", "--only", "never_breaks").refused
