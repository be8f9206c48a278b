"""Stored evidence that was altered or taken away by somebody with the file and a shell."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from functools import partial
from typing import Any, Final

from adeye.store import tables
from adeye.store.encoding import row_hash
from tests.chaos.bench import BASELINE, DB, Bench, Said
from tests.chaos.ways import Do, Way

GREEN: Final = "UPDATE {} SET verdict = 'PASS' WHERE verdict = 'FAIL'"


def gate_alone(bench: Bench) -> Said:
    """Judge the newest campaign without the baseline."""
    return bench.adeye("gate", "--db", DB)


def tampered(*statements: str, then: Do = Bench.gate) -> Do:
    def spoil(bench: Bench) -> Said:
        bench.tamper(*statements)
        return then(bench)

    return spoil


def made_green(*names: str, then: Do = gate_alone) -> Do:
    """Let an FSR fail first, so that the altered database would be green."""

    def spoil(bench: Bench) -> Said:
        with bench.fsr("FSR-06") as fsr:
            fsr["formula"] = "always(abs(ego.lane_offset) <= 0.001 m)"
        assert bench.run().code == 1
        bench.tamper(*map(GREEN.format, names))
        return then(bench)

    return spoil


tally_made_green = made_green("tally", then=Bench.run)


def asked(bench: Bench, *statements: str) -> list[Any]:
    """Execute statements on the database as it is; return what the last one found."""
    with closing(sqlite3.connect(bench.folder / DB)) as raw, raw:
        return [raw.execute(statement).fetchall() for statement in statements][-1]


def hashed_again(bench: Bench) -> Said:
    rows = asked(bench, "SELECT * FROM tally")
    bench.tamper("DELETE FROM tally")
    with closing(sqlite3.connect(bench.folder / DB)) as raw, raw:
        for values in rows:
            hashed = (*values[:-1], row_hash(tables.tally, values[:-1]))
            places = ", ".join("?" * len(hashed))
            raw.execute(f"INSERT INTO tally VALUES ({places})", hashed)  # noqa: S608 - places
    return gate_alone(bench)


def trigger_dropped(bench: Bench) -> Said:
    asked(bench, "DROP TRIGGER tally_no_update")
    return bench.run()


def view_replaced(bench: Bench) -> Said:
    ((ddl,),) = asked(bench, "SELECT sql FROM sqlite_master WHERE name = 'v_gate'")
    asked(bench, "DROP VIEW v_gate", ddl.replace("THEN 'FAIL'", "THEN 'PASS'"))
    return bench.run()


def page_garbled(bench: Bench) -> Said:
    root = "SELECT rootpage FROM sqlite_master WHERE name = 'tally'"
    ((root_page,),) = asked(bench, "PRAGMA wal_checkpoint(TRUNCATE)", root)
    ((size,),) = asked(bench, "PRAGMA page_size")
    with (bench.folder / DB).open("r+b") as file:
        file.seek((root_page - 1) * size)
        file.write(b"\xa5" * size)
    return bench.gate()


def replaced(name: str, old: bytes, new: bytes) -> Do:
    """Replace the last of some bytes in a file, then ask the gate."""

    def spoil(bench: Bench) -> Said:
        path = bench.folder / name
        before, _, after = path.read_bytes().rpartition(old)
        assert before
        path.write_bytes(before + new + after)
        return bench.gate()

    return spoil


def file_cut_short(bench: Bench) -> Said:
    path = bench.folder / DB
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    return bench.gate()


def plugin_changed_midway(bench: Bench) -> Said:
    bench.metric("with open(__file__, 'a') as file: file.write('# changed')")
    return bench.run("--threads", "1")


def replay(bench: Bench) -> Said:
    ((run,),) = asked(bench, "SELECT min(result_digest) FROM run")
    return bench.adeye("replay", run[:12], "--db", DB)


again = partial(tampered, then=Bench.run)
DIGEST: Final = "UPDATE run SET trace_digest = '00' || substr(trace_digest, 3)"


WAYS: Final = [
    Way("deleted result", 4, "run", tampered("DELETE FROM run WHERE number = 1")),
    Way("deleted result, run again", 4, "results are there",
        again("DELETE FROM run WHERE number = 1")),
    Way("deleted metrics of a result", 4, "metrics, events or trace digest",
        tampered("DELETE FROM metric WHERE run_number = 1")),
    Way("deleted verdict", 4, "tally", tampered("DELETE FROM verdict WHERE run_number = 1")),
    Way("deleted tally", 4, "tally", tampered("DELETE FROM tally WHERE fsr_id = 'FSR-06'")),
    Way("deleted block", 4, "work", tampered("DELETE FROM work")),
    Way("deleted block, run again", 4, "blocks cover 0 of 6",
        again("DELETE FROM work")),
    Way("deleted planned case", 4, "campaign_case",
        tampered("DELETE FROM campaign_case WHERE ordinal = 2")),
    Way("deleted campaign", 4, "campaign", tampered("DELETE FROM campaign")),
    Way("FSR taken out of the plan", 4, "campaign_fsr",
        tampered("DELETE FROM campaign_fsr WHERE fsr_id = 'FSR-06'")),
    Way("altered metric", 4, "metric",
        tampered("UPDATE metric SET max_required_deceleration_mps2 = 0.5 WHERE run_number = 1")),
    Way("altered margin", 4, "verdict",
        tampered("UPDATE verdict SET margin = 99 WHERE run_number = 1")),
    Way("altered trace digest", 4, "run", tampered(DIGEST)),
    Way("altered trace digest, replayed", 4, "trace", tampered(DIGEST, then=replay)),
    Way("verdicts made green", 4, "verdict", made_green("verdict", "tally")),
    Way("tally made green, run again", 4, "tally", tally_made_green),
    Way("tally made green and hashed again", 4, "tally", made_green("tally", then=hashed_again)),
    Way("tally counted twice", 4, "tally", tampered("UPDATE tally SET runs = runs + 1")),
    Way("gate flag taken from the plan", 4, "campaign_fsr",
        again("UPDATE campaign_fsr SET mandatory = 0")),
    Way("trigger dropped", 4, "tally_no_update", trigger_dropped),
    Way("view replaced", 4, "v_gate", view_replaced),
    Way("page of the database garbled", 4, "damaged", page_garbled),
    Way("one byte of the database flipped", 4, "camera_radar",
        replaced(DB, b"camera_radar", b"cAmera_radar")),
    Way("database file cut short", 4, "damaged", file_cut_short),
    Way("baseline edited by hand", 4, "was edited after it was written",
        replaced(BASELINE, b'"mandatory": true', b'"mandatory": false')),
    Way("plug-in that changes while it runs", 4, "was changed after", plugin_changed_midway),
]  # fmt: skip
