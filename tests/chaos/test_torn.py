"""A torn log gives back what was committed before the tear; a flipped bit is named or is nothing.

What a log must give back is told by its own frames: every frame that says how large the database is
ends a transaction.
"""

from __future__ import annotations

import hashlib
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from adeye.store.repository import Repository
from tests.chaos.runners import SEED, Undisturbed, record, size
from tests.project import table_hash
from tests.tampering import unguarded

pytestmark = [pytest.mark.chaos, pytest.mark.slow]

OFFSETS: Final = size(40, 500)
FLIPS: Final = size(60, 600)
RESUMED: Final = size(3, 1_000)
LOG_HEADER, FRAME_HEADER = 32, 24


def commits(log: bytes) -> list[int]:
    """Return where each transaction of a log ends, in bytes; the first ends nowhere."""
    page = int.from_bytes(log[8:12], "big")
    places = range(LOG_HEADER, len(log) - FRAME_HEADER - page + 1, FRAME_HEADER + page)
    whole = [place for place in places if int.from_bytes(log[place + 4 : place + 8], "big")]
    return [0, *(place + FRAME_HEADER + page for place in whole)]


def dumped(db: Path) -> str:
    """Hash everything that a database holds, read from the file and its log."""
    hashed = hashlib.sha256()
    with closing(sqlite3.connect(db)) as raw:
        assert raw.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        for line in raw.iterdump():
            hashed.update(line.encode())
    return hashed.hexdigest()


class Torn:
    """A database and its log as a killed runner left them, to be copied and torn."""

    def __init__(self, source: Path, folder: Path) -> None:
        self._main = source.read_bytes()
        self.log = source.with_name(f"{source.name}-wal").read_bytes()
        self._folder = folder
        self._made = 0

    def copy(self, log: bytes) -> Path:
        """Put the database beside another log; nothing else is left of the killed runner."""
        self._made += 1
        db = self._folder / f"torn-{self._made}.db"
        db.write_bytes(self._main)
        db.with_name(f"{db.name}-wal").write_bytes(log)
        return db


def test_torn_log_gives_back_what_was_committed_before(little: Undisturbed) -> None:
    fresh, _ = little.calls
    killed = little.killed_at("killed.db", 3 * fresh // 4)
    torn = Torn(killed, little.folder)
    ends = commits(torn.log)
    assert len(ends) > 8
    wanted = {end: dumped(torn.copy(torn.log[:end])) for end in ends}
    assert len(set(wanted.values())) > 8
    random = np.random.default_rng(SEED)
    resumed: set[int] = set()
    for number in range(OFFSETS):
        offset = int(random.integers(1, len(torn.log)))
        log = bytearray(torn.log)
        if number % 2:
            del log[offset:]
        else:
            # The checksum of a frame goes over it and all before it.
            log[offset] ^= int(random.integers(1, 256))
        end = max(end for end in ends if end <= offset)
        db = torn.copy(bytes(log))
        assert dumped(db) == wanted[end], (number, offset, end)
        # Two offsets in one transaction leave the same database, so one of them is resumed.
        if end not in resumed and len(resumed) < RESUMED:
            resumed.add(end)
            little.resume(db.name)
    record("torn log", offsets=OFFSETS, transactions=len(ends), resumed=len(resumed))


def test_flipped_bit_is_named_or_changes_nothing(little: Undisturbed) -> None:
    random = np.random.default_rng(SEED)
    content = little.db.read_bytes()
    ends = {"named": 0, "refused": 0, "nothing": 0}
    for number in range(FLIPS):
        place, bit = int(random.integers(len(content))), int(random.integers(8))
        flipped = bytearray(content)
        flipped[place] ^= 1 << bit
        db = little.cleared("flipped.db")
        db.write_bytes(flipped)
        said = little.adeye("db", "verify", "--db", db.name)
        where = f"flip {number} of bit {bit} at {place}: {said.text}"
        assert "Traceback" not in said.text, where
        assert "defect of adeye" not in said.text, where
        if said.code == 0:
            ends["nothing"] += 1
            assert table_hash(db) == little.table, where
            if ends["nothing"] <= RESUMED:
                little.resume(db.name)
        elif "1 finding in" in said.text or "findings in" in said.text:
            assert said.code == 4, where
            ends["named"] += 1
        else:
            assert said.code in {4, 5}, where
            assert db.name in said.text, where
            ends["refused"] += 1
    assert ends["named"] > FLIPS // 8
    record("flipped bits", flips=FLIPS, **ends)


def test_altered_figure_is_named_with_table_and_row(little: Undisturbed) -> None:
    """What a flip does where it is a value: each of many rows is named as the one it is."""
    random = np.random.default_rng(SEED)
    db = little.folder / "figure.db"
    for _ in range(size(5, 50)):
        shutil.copy(little.db, db)
        with closing(sqlite3.connect(db)) as raw, raw, unguarded(raw):
            rows = raw.execute("SELECT number, result_digest FROM run ORDER BY number").fetchall()
            run, digest = rows[int(random.integers(len(rows)))]
            raw.execute(
                "UPDATE metric SET min_ttc_s = min_ttc_s + 1e-9 WHERE run_number = ?", [run]
            )
        with Repository.open(db, create=False) as repository:
            named = {(item.table, item.row.split()[0]) for item in repository.verify()}
        assert named == {("metric", digest), ("run", digest)}
