"""Databases that others spoilt or wrote with intent: documented exit codes, no write, no import."""

from __future__ import annotations

import os
import shutil
import sqlite3
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from adeye.cli.app import main
from tests.chaos.mutation import Draw, bytes_of
from tests.chaos.test_fuzz import DOCUMENTED, SLOW, listing, watched
from tests.project import Executed
from tests.tampering import unguarded

ORDINARY: Final = 60
VERBS: Final = (
    ("db", "verify"), ("gate",), ("show", "RUN"), ("matrix",), ("query", "SELECT * FROM v_runs"),
    ("db", "info"), ("query", "SELECT * FROM v_gate"), ("faults",), ("timeline", "RUN"),
)  # fmt: skip
_JUNK: Final = (
    None, 0, -1, 2**62, 1e308, float("inf"), "", "x", "[]", "{}", "null", "[" * 5000, '{"a": NaN}',
    b"\xff\xfe", "a" * 1_000_000, "\x1b[2J", "../../etc/passwd", "1" * 5000, "[1e999]", "9" * 19,
)  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path, mini: Executed, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in os.environ:
        if name.startswith("ADEYE_") and name != "ADEYE_NUMBA_CACHE_DIR":
            monkeypatch.delenv(name)
    monkeypatch.setenv("COLUMNS", "500")
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    shutil.copyfile(mini.db, tmp_path / "sound.db")
    main_db(work)
    return work


def main_db(folder: Path) -> Path:
    path = folder / "a.db"
    for item in folder.glob("a.db*"):
        item.unlink()
    shutil.copyfile(folder.parent / "sound.db", path)
    return path


def a_run(path: Path) -> str:
    raw = sqlite3.connect(path)
    # Without a fault there is nothing that a timeline could show.
    faulted = "SELECT run FROM v_runs WHERE fault_entry <> 'none' ORDER BY run LIMIT 1"
    (found,) = raw.execute(faulted).fetchone()
    raw.close()
    return str(found)


def spoil_cell(path: Path, draw: Draw) -> None:
    """Put something else into one to three columns of some row, past all rules."""
    raw = sqlite3.connect(path, isolation_level=None)
    tables = [
        str(name)
        for (name,) in raw.execute(
            "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite%'"
        )
        if raw.execute(f"SELECT 1 FROM {name} LIMIT 1").fetchone()  # noqa: S608
    ]
    with unguarded(raw):
        for _ in range(int(draw.integers(1, 4))):
            table = tables[int(draw.integers(0, len(tables)))]
            columns = [str(row[1]) for row in raw.execute(f"PRAGMA table_info({table})")]
            column = columns[int(draw.integers(0, len(columns)))]
            junk = _JUNK[int(draw.integers(0, len(_JUNK)))]
            try:
                raw.execute(
                    f'UPDATE {table} SET "{column}" = ? WHERE rowid = (SELECT rowid '  # noqa: S608
                    f"FROM {table} LIMIT 1 OFFSET ? % (SELECT count(*) FROM {table}))",
                    (junk, int(draw.integers(0, 2**31))),
                )
            except sqlite3.Error:
                continue
    raw.close()


def fuzz(seeds: range, folder: Path, capfd: pytest.CaptureFixture[str]) -> dict[int, int]:
    path = folder / "a.db"
    valid = path.read_bytes()
    run = a_run(path)
    for verb in VERBS:
        # What a verb says of a spoilt database means something only if it reads a sound one. It
        # also compiles the kernels now, which no spoilt database is to be blamed for.
        words = [run if word == "RUN" else word for word in verb]
        assert main([*words, "--db", "a.db"]) == 0, verb
    before = listing(folder.parent)
    codes: dict[int, int] = {}
    failed = []
    for seed in seeds:
        draw = np.random.default_rng([seed, 77])
        for item in folder.glob("a.db*"):
            item.unlink()
        if seed % 2:
            path.write_bytes(valid)
            spoil_cell(path, draw)
        else:
            path.write_bytes(bytes_of(valid, draw))
        verb = VERBS[seed % len(VERBS)]
        words = [run if word == "RUN" else word for word in verb]
        capfd.readouterr()
        try:
            with watched():
                code = main([*words, "--db", "a.db"])
        except BaseException as error:  # noqa: BLE001 - whatever it is, the seed is wanted
            failed.append(f"seed {seed} {verb}: {type(error).__name__}: {str(error)[:300]}")
            continue
        said = "".join(capfd.readouterr())
        codes[code] = codes.get(code, 0) + 1
        if code not in DOCUMENTED or "Traceback" in said or "defect of adeye" in said:
            failed.append(f"seed {seed} {verb}: exit {code}: {said[:400]}")
    assert not failed, f"{len(failed)} of {len(seeds)}\n" + "\n".join(failed[:20])
    assert {name for name in listing(folder.parent) - before if "a.db-" not in name} == set()
    return codes


@pytest.mark.slow
def test_spoilt_databases_are_refused_or_read(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    codes = fuzz(range(ORDINARY), folder, capfd)
    assert codes.get(4, 0) + codes.get(5, 0) + codes.get(2, 0) >= 5, codes


@pytest.mark.chaos
@pytest.mark.slow
def test_many_spoilt_databases_are_refused_or_read(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    fuzz(range(ORDINARY, ORDINARY + SLOW), folder, capfd)


@pytest.mark.slow
def test_names_of_files_lead_nowhere(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A file of traces is looked for by its hash: no name in a database leads out of the folder."""
    path = folder / "a.db"
    run = a_run(path)
    (folder / "a.db.traces").mkdir()
    (folder.parent / "outside.npz").write_bytes(b"planted")
    before = listing(folder.parent)
    raw = sqlite3.connect(path, isolation_level=None)
    for name in (
        "../../outside",
        str(folder.parent / "outside"),
        "\x1b[2J\n../../outside",
        "",
        "a" * 5000,
    ):
        with unguarded(raw):
            raw.execute("DELETE FROM kept_trace")
            raw.execute(
                "INSERT INTO kept_trace SELECT MIN(number), ?, 0, ? FROM run", (name, "0" * 32)
            )
        for verb, codes in (
            (("db", "verify"), {4}), (("show", run), {0}), (("manifest", "write"), {2, 4}),
        ):  # fmt: skip
            capfd.readouterr()
            assert main([*verb, "--db", "a.db"]) in codes, (name, verb)
            said = "".join(capfd.readouterr())
            assert "Traceback" not in said, (name, verb)
            assert "defect of adeye" not in said, (name, verb)
            assert "\x1b" not in said, (name, verb)
    raw.close()
    assert {name for name in listing(folder.parent) - before if "a.db-" not in name} == set()
    assert (folder.parent / "outside.npz").read_bytes() == b"planted"


@pytest.mark.slow
def test_reading_never_imports_what_a_database_names(
    folder: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its writer controls the names of plug-ins and their folder; only who executes loads them."""
    canary = folder / "canary"
    (folder / "evil_plugin.py").write_text(f"open({str(canary)!r}, 'w')\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(folder))
    path = folder / "a.db"
    run = a_run(path)
    raw = sqlite3.connect(path)
    changed = 0
    with unguarded(raw):
        for (table,) in raw.execute(
            "SELECT name FROM sqlite_master WHERE type = 'table'"
        ).fetchall():
            for row in raw.execute(f"PRAGMA table_info({table})").fetchall():
                for kind in ("./evil_plugin.py:Evil", "evil_plugin:Evil"):
                    changed += raw.execute(
                        f'UPDATE {table} SET "{row[1]}" = replace("{row[1]}", ?, ?) '  # noqa: S608
                        f'WHERE instr("{row[1]}", ?) > 0',
                        ('"kind":"nominal"', f'"kind":"{kind}"', '"kind":"nominal"'),
                    ).rowcount
    raw.commit()
    raw.close()
    assert changed > 0
    for verb in VERBS:
        words = [run if word == "RUN" else word for word in verb]
        assert main([*words, "--db", "a.db"]) in DOCUMENTED
    capfd.readouterr()
    assert not canary.exists()


@pytest.mark.parametrize(
    "statement",
    [
        "CREATE TRIGGER evil AFTER INSERT ON campaign BEGIN DELETE FROM run; END",
        "CREATE VIEW evil AS SELECT randomblob(1000000000)",
        "CREATE VIEW evil AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) "
        "SELECT sum(x) FROM c",
        "CREATE VIEW evil AS SELECT load_extension('evil')",
        "CREATE VIEW evil AS SELECT writefile('canary', 'x')",
    ],
)
def test_hostile_definitions_are_contained(
    folder: Path, capfd: pytest.CaptureFixture[str], statement: str
) -> None:
    raw = sqlite3.connect(folder / "a.db")
    raw.execute(statement)
    raw.commit()
    raw.close()
    before = listing(folder)
    assert main(["db", "info", "--db", "a.db"]) in DOCUMENTED
    if "VIEW" in statement:
        code = main(["query", "SELECT * FROM evil", "--timeout-s", "0.5", "--db", "a.db"])
        assert code == 2
    said = capfd.readouterr().err
    assert "defect" not in said
    assert {name for name in listing(folder) - before if "a.db-" not in name} == set()
