"""``certify`` on the command line: exit codes, tables and JSON."""

from __future__ import annotations

import json
import shutil
import sqlite3
from typing import TYPE_CHECKING

import pytest

from adeye.campaign.studies import certify as certificate
from adeye.campaign.studies.certify import CONDITIONS
from adeye.cli.app import main

if TYPE_CHECKING:
    from pathlib import Path

    from tests.project import Executed


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
