"""One row edited, deleted, inserted or exchanged, in every table, by somebody with a shell.

The triggers are put back afterwards, and every other time the row gets the hash that it would
have had. ``db verify`` names the table and the row each time: of each kind in a few tables, in all
tables with ``-m slow``, and there also many times at random, with the manifest refused each time.
"""

from __future__ import annotations

import hashlib
import json
import random  # noqa: TID251 - picks what to alter; no simulated noise
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
from sqlalchemy import Table

from adeye.errors import IntegrityError
from adeye.report.formats.manifest import differing, make_manifest
from adeye.store import ledger, tables
from adeye.store.block import JudgedBlock
from adeye.store.encoding import hashed_names, row_hash, row_hashes, stored_words
from adeye.store.evidence import verification
from adeye.store.evidence.roots import folder_of
from adeye.store.plugin_metrics import plugin_tables
from adeye.store.records import Finding, MetricValue
from adeye.store.repository import Repository
from tests.chaos.runners import size
from tests.store.conftest import Example, Store
from tests.store.rows import run_block
from tests.tampering import unguarded

KINDS: Final = ("edit", "delete", "insert", "exchange")
TRIALS: Final = size(40, 100)
UNIQUE: Final = {"campaign": ("number", "id"), "run": ("number", "result_digest")}
"""Keys of tables that have two."""

Raw = sqlite3.Connection


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database with rows in every table that is only added to."""
    path = tmp_path_factory.mktemp("whole") / "adeye.db"
    example = Example()
    with Repository.open(path) as repository:
        Store(repository, example).everything()
        with_plugin(example, repository)
        assert repository.verify() == ()
    return path


def with_plugin(example: Example, repository: Repository) -> None:
    """Execute a few more runs with a metric of a plug-in."""
    example.thresholds = {"FSR1": "more"}

    def run(case: Any) -> Any:
        measured = {"their": {"their_metric": MetricValue(1.0 + case.ordinal)}}
        return example.run(case, plugin_metrics=measured)

    plan = repository.plan_campaign(example.record(), example.cases(16), block_size=8)
    while (block := repository.claim_block(campaign=plan.campaign)) is not None:
        runs = run_block([run(case) for case in block.to_execute])
        runs = replace(runs, basis=example.basis(len(runs)))
        assert repository.complete_block(block, runs, JudgedBlock.of(example.judged(block)))


@dataclass(frozen=True)
class Tampering:
    """One change to one row.

    Attributes:
        table: Where.
        kind: One of ``KINDS``.
        is_hashed: Whether the row gets a matching hash.
        what: In words, for the message of a test that fails.
    """

    table: str
    kind: str
    is_hashed: bool
    what: str


@contextmanager
def opened(path: Path) -> Iterator[Raw]:
    """Open the file without triggers, and put them back."""
    with closing(sqlite3.connect(path, isolation_level=None)) as raw, unguarded(raw):
        yield raw


def described(path: Path) -> list[Table]:
    """List every table of evidence, those of plug-ins too."""
    with Repository.open(path, create=False) as repository, repository._database.read() as read:
        return [*tables.INSERT_ONLY, *plugin_tables(read)]


def tamper(path: Path, table: Table, kind: str, picks: random.Random, *, hashed: bool) -> Tampering:
    names = [column.name for column in table.columns]
    key = [column.name for column in table.primary_key.columns]
    with opened(path) as raw:
        rows = raw.execute(f"SELECT {', '.join(names)} FROM {table.name}").fetchall()  # noqa: S608
        one = picks.choice(rows)
        if kind == "exchange":
            said = [place for place, name in enumerate(names[:-1]) if name not in key]
            differ = [item for item in rows if any(item[place] != one[place] for place in said)]
            other = picks.choice(differ) if differ else None
            kind = kind if other else "edit"
        if kind == "exchange":
            assert other is not None
            keys = [names.index(name) for name in key]
            for before in (one, other):
                remove(raw, table, before)
            for own, said_of in ((one, other), (other, one)):
                after = [(own if at in keys else said_of)[at] for at in range(len(names))]
                insert(raw, table, after, hashed=hashed)
            what = f"{one} and {other}"
        elif kind == "delete":
            remove(raw, table, one)
            what = str(one)
        elif kind == "insert":
            after = list(one)
            for name in {picks.choice(key), *UNIQUE.get(table.name, ())}:
                place = names.index(name)
                after[place] = other_value(table, place, after[place])
            insert(raw, table, after, hashed=hashed)
            what = str(after)
        else:
            after = list(one)
            place = picks.randrange(len(names) - 1)
            after[place] = other_value(table, place, after[place])
            remove(raw, table, one)
            insert(raw, table, after, hashed=hashed)
            what = f"{names[place]} of {one}"
    return Tampering(table.name, kind, hashed, what)


def other_value(table: Table, place: int, value: Any) -> Any:
    kind = list(table.columns)[place].type.python_type
    if kind is bool:
        return 1 - int(value or 0)
    if kind in (int, float):
        return kind((value or 0) + 1000)
    text = str(value or "")
    if len(text) in (32, 64) and set(text) <= set("0123456789abcdef"):
        return hashlib.sha256(text.encode()).hexdigest()[: len(text)]
    return f"{text}x"


def remove(raw: Raw, table: Table, values: Any) -> None:
    names = [column.name for column in table.columns]
    same = " AND ".join(f"{name} IS ?" for name in names)
    done = raw.execute(f"DELETE FROM {table.name} WHERE {same}", values)  # noqa: S608 - own names
    assert done.rowcount == 1


def insert(raw: Raw, table: Table, values: list[Any], *, hashed: bool) -> None:
    if hashed:
        values = [*values[:-1], hash_of(raw, table, values)]
    names = [column.name for column in table.columns]
    marks = ", ".join("?" * len(names))
    raw.execute(f"INSERT INTO {table.name} ({', '.join(names)}) VALUES ({marks})", values)  # noqa: S608


def hash_of(raw: Raw, table: Table, values: Any) -> str:
    """Give the hash that adeye would have given."""
    if table is tables.seal:
        return ledger.seal_hashes([np.array([value], dtype=np.int64) for value in values[:-1]])[0]
    if table not in tables.RESULTS and table.name in tables.metadata.tables:
        return row_hash(table, values[:-1])
    hashed = list(values[1:-1])
    if table is not tables.run:
        found = raw.execute("SELECT result_digest FROM run WHERE number = ?", values[:1]).fetchone()
        hashed = [found and found[0], *hashed]
    return row_hashes(table, stored_words(table, hashed_names(table), [tuple(hashed)]))[0]


def findings(path: Path) -> tuple[Finding, ...]:
    with Repository.open(path, create=False) as repository:
        return repository.verify()


def is_named(found: tuple[Finding, ...], done: Tampering) -> bool:
    # A seal tells which rows a run has, so what another seal says is found where they are.
    told = {done.table} if done.table != "seal" else {"seal", *tables.SEALED}
    return any(item.table in told and item.row for item in found)


def tried(
    whole: Path, copy: Path, table: Table, kind: str, seed: int
) -> tuple[Tampering, tuple[Finding, ...]]:
    shutil.copyfile(whole, copy)
    picks = random.Random(seed)  # noqa: S311 - what to alter
    done = tamper(copy, table, kind, picks, hashed=seed % 2 == 1)
    return done, findings(copy)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_tampering_with_a_few_tables_is_named(whole: Path, tmp_path: Path, kind: str) -> None:
    picks = random.Random(kind)  # noqa: S311 - which tables
    for seed, table in enumerate(picks.sample(described(whole), 5)):
        done, found = tried(whole, tmp_path / "copy.db", table, kind, seed)
        assert is_named(found, done), (done, found)


@pytest.mark.chaos
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2 * len(KINDS)))
def test_tampering_with_every_table_is_named(whole: Path, tmp_path: Path, seed: int) -> None:
    # Of each kind either with the hash of the row or without it, in full with and without.
    for table in list(described(whole))[size(seed % 2, 0) :: size(2, 1)]:
        kind = KINDS[seed // 2]
        done, found = tried(whole, tmp_path / "copy.db", table, kind, seed)
        assert is_named(found, done), (done, found)


def manifest_of(whole: Path, folder: Path) -> dict[str, Any]:
    """Make the manifest of the newest campaign, with a file for the traces that it names."""
    with Repository.open(whole, create=False) as repository:
        kept = folder_of(folder / "copy.db")
        kept.mkdir()
        for name in repository.evidence.kept_files():
            (kept / f"{name}.npz").write_bytes(b"traces")
        shutil.copytree(kept, folder_of(whole), dirs_exist_ok=True)
        campaign = repository.find_campaign()
        found: dict[str, Any] = json.loads(make_manifest(repository, campaign, [], folder))
        return found


def fails(document: dict[str, Any], path: Path) -> bool:
    """Tell whether a manifest is refused."""
    with Repository.open(path, create=False) as repository:
        try:
            return bool(tuple(differing(document, path.parent, repository)))
        except IntegrityError:
            return True


@pytest.mark.chaos
@pytest.mark.slow
def test_many_tamperings_are_named_and_the_manifest_fails(whole: Path, tmp_path: Path) -> None:
    picks = random.Random(17)  # noqa: S311 - which table and row
    known = described(whole)
    missed = []
    document = manifest_of(whole, tmp_path)
    copy = tmp_path / "copy.db"
    shutil.copyfile(whole, copy)
    assert not fails(document, copy)
    for trial in range(TRIALS):
        table, kind = picks.choice(known), picks.choice(KINDS)
        done, found = tried(whole, copy, table, kind, 1000 + trial)
        if not is_named(found, done) or not fails(document, copy):
            missed.append((done, found))
    print(f"{TRIALS - len(missed)} of {TRIALS} tamperings were named")  # noqa: T201
    assert missed == []


@pytest.mark.slow
def test_rows_that_are_gone_would_not_be_missed_without_the_ledger(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done, found = tried(whole, tmp_path / "copy.db", tables.timing, "delete", 3)
    assert is_named(found, done)
    monkeypatch.setattr(verification, "unbalanced", lambda _: iter(()))
    monkeypatch.setattr(verification, "wrong_roots", lambda _: iter(()))
    assert not is_named(findings(tmp_path / "copy.db"), done)


@pytest.mark.parametrize("table", ["criticality", "timing", "extreme", "basis", "takeover"])
def test_emptied_table_of_derived_rows_is_named(whole: Path, tmp_path: Path, table: str) -> None:
    shutil.copyfile(whole, tmp_path / "copy.db")
    with opened(tmp_path / "copy.db") as raw:
        raw.execute(f"DELETE FROM {table}")  # noqa: S608 - a name of this test
    named = findings(tmp_path / "copy.db")
    assert table in {item.table for item in named}
    assert "schema" not in {item.table for item in named}


def test_triggers_are_put_back_as_they_were(whole: Path, tmp_path: Path) -> None:
    shutil.copyfile(whole, tmp_path / "copy.db")
    with opened(tmp_path / "copy.db") as raw:
        names = "SELECT name FROM sqlite_master WHERE type = 'trigger'"
        assert raw.execute(names).fetchall() == []
    assert findings(tmp_path / "copy.db") == ()
