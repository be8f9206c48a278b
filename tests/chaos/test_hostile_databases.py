"""Databases that others spoilt or wrote with intent: documented exit codes, no write, no import."""

from __future__ import annotations

import shutil
import sqlite3
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from adeye.cli.app import main
from tests.chaos.mutation import Draw, bytes_of
from tests.chaos.test_fuzz import DOCUMENTED, SLOW, defect_of, fed, listing
from tests.hostile_sql import STATEMENTS
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
def folder(tmp_path: Path, mini: Executed, unset: pytest.MonkeyPatch) -> Path:
    work = tmp_path / "work"
    work.mkdir()
    unset.chdir(work)
    shutil.copyfile(mini.db, work / "a.db")
    return work


def named(verb: tuple[str, ...], run: str) -> list[str]:
    """Write a verb out with its run and the database."""
    return [*(run if word == "RUN" else word for word in verb), "--db", "a.db"]


def added(folder: Path, before: set[str]) -> set[str]:
    """List what is there now besides, but for what belongs to the open database."""
    return {name for name in listing(folder) - before if "a.db-" not in name}


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


def fuzz(seeds: range, folder: Path, capfd: pytest.CaptureFixture[str]) -> Counter[int]:
    path = folder / "a.db"
    valid = path.read_bytes()
    run = a_run(path)
    for verb in VERBS:
        # What a verb says of a spoilt database means something only if it reads a sound one. It
        # also compiles the kernels now, which no spoilt database is to be blamed for.
        assert main(named(verb, run)) == 0, verb
    before = listing(folder.parent)

    def put(seed: int) -> Callable[[], int]:
        draw = np.random.default_rng([seed, 77])
        for item in folder.glob("a.db*"):
            item.unlink()
        if seed % 2:
            path.write_bytes(valid)
            spoil_cell(path, draw)
        else:
            path.write_bytes(bytes_of(valid, draw))
        return partial(main, named(VERBS[seed % len(VERBS)], run))

    codes = fed(seeds, put, defect_of, capfd)
    assert added(folder.parent, before) == set()
    return codes


@pytest.mark.slow
def test_spoilt_databases(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    codes = fuzz(range(ORDINARY), folder, capfd)
    assert codes[4] + codes[5] + codes[2] >= 5, codes


@pytest.mark.chaos
@pytest.mark.slow
def test_many_spoilt_databases(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
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
    outside = ("../../outside", str(folder.parent / "outside"), "\x1b[2J\n../../outside")
    for name in (*outside, "", "a" * 5000):
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
            assert defect_of(0, said) == "", (name, verb)
            assert "\x1b" not in said, (name, verb)
    raw.close()
    assert added(folder.parent, before) == set()
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
        assert main(named(verb, run)) in DOCUMENTED
    capfd.readouterr()
    assert not canary.exists()


@pytest.mark.parametrize("statement", STATEMENTS["hostile_definitions"])
def test_hostile_views(folder: Path, capfd: pytest.CaptureFixture[str], statement: str) -> None:
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
    assert added(folder, before) == set()
