"""``certify`` and ``selftest``."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from adeye.campaign.studies import certify as certificate
from adeye.campaign.studies.certify import CONDITIONS
from adeye.cli import certify as verb
from adeye.judge.verdict import ExitCode
from adeye.selftest import running
from adeye.selftest.bench import Master, Seen
from adeye.store.repository import Repository
from tests.cli.conftest import Outcome, Verb
from tests.project import Executed
from tests.sql import alter, rows

# --- ``certify`` on the command line: exit codes, tables and JSON


@pytest.fixture
def certify(
    mini: Executed, adeye: Verb, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., Outcome]:
    """Certify a copy of the mini campaign under two conditions."""
    monkeypatch.setattr(certificate, "CONDITIONS", CONDITIONS[1:3])
    shutil.copyfile(mini.db, tmp_path / "mini.db")
    given = ("certify", str(mini.project.odd), "--db", "mini.db", "--quiet")
    return lambda *options: adeye(*given, *options)


@pytest.mark.slow
def test_deterministic_campaign_is_certified(certify: Callable[..., Outcome]) -> None:
    done = certify("--sample", "10").ok
    assert "10 of 28 runs, from 8 combinations" in done.out
    assert "batches of 7, reversed, in this process" in done.out
    assert " compared\n" in done.out
    assert "Certified: every trace, metric and verdict" in done.out


@pytest.mark.slow
def test_run_that_differs_is_named(
    certify: Callable[..., Outcome], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # As if it had been written so.
    monkeypatch.setattr(Repository, "require_sound", lambda *_: None)
    alter(folder / "mini.db", "UPDATE run SET trace_digest = 'other' WHERE number = 1")
    [(run,)] = rows(folder / "mini.db", "SELECT result_digest FROM run WHERE number = 1")
    done = certify()
    assert done.code == 4
    assert run[:10] in done.out
    assert "every one" in done.out
    assert "NOT CERTIFIED: 1 of 28 runs differ, in the same way under every condition" in done.out
    done = certify("--json")
    assert (done.code, done.document["schema"]) == (4, "adeye/certify@1")
    assert done.document["certified"] is False
    assert [item["run"] for item in done.document["findings"]] == [run]


@pytest.mark.slow
def test_nothing_is_certified_without_a_verdict(
    certify: Callable[..., Outcome], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(certificate, "_same_verdicts", lambda *_: {})
    done = certify("--sample", "1")
    assert done.code == ExitCode.INCOMPLETE
    assert "NOT CERTIFIED: no verdict could be compared" in done.out
    assert rows(folder / "mini.db", "SELECT * FROM certificate") == []


def test_unknown_campaign_is_an_input_error(adeye: Verb, mini: Executed) -> None:
    assert "ffff" in adeye("certify", "ffff", "--db", str(mini.db)).refused


# --- ``selftest``: exit code 4 names what was not found; only a complete one is kept


def master(name: str, found: str, twin: int = 0) -> Master:
    """A master of which something is found or not, and whose good twin is refused or not."""
    code = 2 if found else 0
    seen = Seen(code, found), Seen(twin, "")
    return Master(name, "file", "w", "f", 2, "wrong", lambda _: seen[0], lambda _: seen[1])


GOOD, BLIND = master("good_one", "wrong"), master("blind_one", "")


@pytest.fixture
def masters(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Take other masters than the real ones, which take their time."""

    def use(*chosen: Master) -> None:
        monkeypatch.setattr(running, "MASTERS", chosen)

    return use


@pytest.mark.slow
def test_real_master_by_name_is_detected_and_nothing_is_kept(adeye: Any, folder: Path) -> None:
    ended = adeye("selftest", "--only", "unit_missing").ok
    assert "1 of 1 detected" in ended.out
    assert verb.REMARK in ended.out
    assert list(folder.iterdir()) == []


def test_complete_self_test_is_kept(adeye: Any, folder: Path, masters: Any) -> None:
    masters(GOOD)
    assert adeye("selftest", "--quiet").code == 0
    kept = json.loads((folder / ".adeye" / "selftest.json").read_text("utf-8"))
    assert (kept["masters"], kept["detected"]) == (1, 1)
    assert adeye("selftest", "--db", "other/x.db").code == 0
    assert [path.name for path in (folder / "other").iterdir()] == ["selftest.json"]


def test_undetected_master_is_named_and_kept(adeye: Any, folder: Path, masters: Any) -> None:
    masters(GOOD, BLIND)
    ended = adeye("selftest")
    assert ended.code == ExitCode.INTEGRITY
    assert "blind_one" in ended.err
    assert "good_one" not in ended.err
    assert "NOT DETECTED" in ended.out
    kept = json.loads((folder / ".adeye" / "selftest.json").read_text("utf-8"))
    assert kept["undetected"] == ["blind_one"]


def test_rejected_twin_is_named_with_exit_code_4(adeye: Any, masters: Any) -> None:
    masters(master("m", "wrong", twin=1))
    ended = adeye("selftest", "--quick")
    assert ended.code == ExitCode.INTEGRITY
    assert "REJECTED" in ended.out


def test_json_has_what_was_seen(adeye: Any, masters: Any) -> None:
    masters(GOOD, BLIND)
    document = adeye("selftest", "--json").document
    assert [item["is_detected"] for item in document["results"]] == [True, False]


def test_list_runs_nothing(adeye: Any, folder: Path) -> None:
    listed = adeye("selftest", "--list", "--json").document["masters"]
    assert [item["name"] for item in listed] == [item.name for item in running.MASTERS]
    assert "never_brakes" in adeye("selftest", "--list").out
    assert list(folder.iterdir()) == []


def test_unknown_master_is_an_input_error(adeye: Any) -> None:
    assert "Did you mean 'never_brakes'" in adeye("selftest", "--only", "never_breaks").refused
