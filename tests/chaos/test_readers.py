"""Sixteen people look at a campaign while it runs: nobody is locked out, nobody waits for them."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Final

import pytest

from tests.chaos.bench import Said
from tests.chaos.runners import IS_FULL, Runner, Undisturbed, record, run_of, size, undisturbed

pytestmark = [pytest.mark.chaos, pytest.mark.slow]

RUNS: Final = size(0, 10_000)
READERS: Final = size(4, 16)
EVERY_S: Final = 2.0
AT_LEAST_S: Final = size(0, 60)
MOST_GROWTH: Final = 0.10
QUERIES: Final = (
    ("query", "SELECT architecture, fsr, verdict FROM v_gate ORDER BY 1, 2"),
    ("query", "SELECT COUNT(*) FROM v_runs"),
    ("db", "info"),
    ("query", "SELECT scenario, MIN(min_ttc_s) FROM v_runs GROUP BY scenario ORDER BY 1"),
)


def run_timed(whole: Undisturbed, db: str) -> tuple[Runner, Path]:
    """Start the campaign anew, with how long it waits for the database in a file."""
    waited = whole.folder / f"{db}.waited"
    return whole.start(*run_of(db), timed=waited), waited


def watched(whole: Undisturbed, db: str) -> tuple[float, float, list[Said]]:
    """Run while readers look; return wall time, time waited [s] and what the readers saw."""
    (whole.folder / db).unlink(missing_ok=True)
    begun = time.monotonic()
    runner, waited = run_timed(whole, db)
    seen: list[Said] = []
    readers: list[Runner | None] = [None] * READERS
    turn = 0
    while not runner.is_over:
        # Readers come one after the other, each every two seconds; none asks before it has heard.
        time.sleep(EVERY_S / READERS)
        turn += 1
        place = turn % READERS
        reader = readers[place]
        if not (whole.folder / f"{db}-wal").exists() or not (reader is None or reader.is_over):
            continue
        if reader is not None:
            seen.append(reader.wait())
        # Every reader asks everything in turn.
        verb = QUERIES[(turn + turn // READERS) % len(QUERIES)]
        readers[place] = whole.start(*verb, "--db", db)
    assert runner.wait().code == 0
    wall = time.monotonic() - begun
    seen += [reader.wait() for reader in readers if reader is not None]
    whole.assert_identical(whole.folder / db)
    return wall, float(waited.read_text("ascii")), seen


def test_readers_are_never_locked_out(whole: Undisturbed, tmp_path: Path) -> None:
    if IS_FULL:
        whole = undisturbed(whole.cradle, tmp_path / "project", RUNS, block=10)
    begun = time.monotonic()
    runner, alone_file = run_timed(whole, "alone.db")
    assert runner.wait().code == 0
    alone_wall = time.monotonic() - begun
    alone = float(alone_file.read_text("ascii"))
    wall, waited, seen = watched(whole, "watched.db")
    assert len(seen) >= READERS // 2
    for said in seen:
        # The tables may not be there yet; whatever else is said, it is not that others write.
        assert "locked" not in said.text
        assert said.code == 0 or "schema" in said.text, said.text
    growth = (waited - alone) / alone_wall
    figures = {"wall_s": wall, "wall_alone_s": alone_wall, "waited_s": waited}
    figures |= {"waited_alone_s": alone, "growth_of_waiting_by_wall": growth}
    rounded = {name: round(value, 4) for name, value in figures.items()}
    record("readers", queries=len(seen), locked_out=0, **rounded)
    if IS_FULL:
        assert wall >= AT_LEAST_S
        assert growth <= MOST_GROWTH
