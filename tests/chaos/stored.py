"""Stored evidence that was altered or taken away by somebody with the file and a shell."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from typing import Final

from adeye.store import tables
from adeye.store.encoding import row_hash
from tests.chaos.bench import BASELINE, DB, Bench, Said
from tests.chaos.ways import Way


def tampered(*statements: str, verb: str = "gate") -> Callable[[Bench], Said]:
    def spoil(bench: Bench) -> Said:
        bench.tamper(*statements)
        return bench.gate() if verb == "gate" else bench.run()

    return spoil


def failing_made_green(bench: Bench, *statements: str) -> None:
    """Let an FSR fail first, so that the altered database would be green."""
    with bench.fsr("FSR-06") as fsr:
        fsr["formula"] = "always(abs(ego.lane_offset) <= 0.001 m)"
    assert bench.run().code == 1
    bench.tamper(*statements)


def verdict_made_green(bench: Bench) -> Said:
    failing_made_green(
        bench,
        "UPDATE verdict SET verdict = 'PASS' WHERE verdict = 'FAIL'",
        "UPDATE tally SET verdict = 'PASS' WHERE verdict = 'FAIL'",
    )
    return bench.adeye("gate", "--db", DB)


def tally_made_green(bench: Bench) -> Said:
    failing_made_green(bench, "UPDATE tally SET verdict = 'PASS' WHERE verdict = 'FAIL'")
    return bench.run()


def tally_hashed_again(bench: Bench) -> Said:
    failing_made_green(bench, "UPDATE tally SET verdict = 'PASS' WHERE verdict = 'FAIL'")
    with sqlite3.connect(bench.folder / DB) as raw:
        rows = raw.execute("SELECT * FROM tally").fetchall()
    bench.tamper("DELETE FROM tally")
    with sqlite3.connect(bench.folder / DB) as raw:
        for values in rows:
            hashed = (*values[:-1], row_hash(tables.tally, values[:-1]))
            places = ", ".join("?" * len(hashed))
            raw.execute(f"INSERT INTO tally VALUES ({places})", hashed)  # noqa: S608 - places
    raw.close()
    return bench.adeye("gate", "--db", DB)


def trigger_dropped(bench: Bench) -> Said:
    with sqlite3.connect(bench.folder / DB) as raw:
        raw.execute("DROP TRIGGER tally_no_update")
    raw.close()
    return bench.run()


def view_replaced(bench: Bench) -> Said:
    with sqlite3.connect(bench.folder / DB) as raw:
        (ddl,) = raw.execute("SELECT sql FROM sqlite_master WHERE name = 'v_gate'").fetchone()
        raw.execute("DROP VIEW v_gate")
        raw.execute(ddl.replace("THEN 'FAIL'", "THEN 'PASS'"))
    raw.close()
    return bench.run()


def page_garbled(bench: Bench) -> Said:
    with sqlite3.connect(bench.folder / DB) as raw:
        raw.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        (root,) = raw.execute("SELECT rootpage FROM sqlite_master WHERE name = 'tally'").fetchone()
        (size,) = raw.execute("PRAGMA page_size").fetchone()
    raw.close()
    with (bench.folder / DB).open("r+b") as file:
        file.seek((root - 1) * size)
        file.write(b"\xa5" * size)
    return bench.gate()


def page_of_a_value(bench: Bench) -> Said:
    path = bench.folder / DB
    content = path.read_bytes()
    at = content.rindex(b"camera_radar")
    path.write_bytes(content[:at] + b"cAmera_radar" + content[at + 12 :])
    return bench.gate()


def file_cut_short(bench: Bench) -> Said:
    path = bench.folder / DB
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    return bench.gate()


def baseline_edited(bench: Bench) -> Said:
    path = bench.folder / BASELINE
    text = path.read_text("utf-8")
    assert '"mandatory": true' in text
    path.write_text(text.replace('"mandatory": true', '"mandatory": false', 1), "utf-8")
    return bench.gate()


def plugin_changed_midway(bench: Bench) -> Said:
    bench.metric("with open(__file__, 'a') as file: file.write('# changed')")
    return bench.run("--threads", "1")


def replay_of_altered_digest(bench: Bench) -> Said:
    bench.tamper("UPDATE run SET trace_digest = '00' || substr(trace_digest, 3)")
    with sqlite3.connect(bench.folder / DB) as raw:
        (run,) = raw.execute("SELECT min(result_digest) FROM run").fetchone()
    raw.close()
    return bench.adeye("replay", run[:12], "--db", DB)


WAYS: Final = [
    Way("deleted result", 4, "run", tampered("DELETE FROM run WHERE number = 1")),
    Way("deleted result, run again", 4, "results are there",
        tampered("DELETE FROM run WHERE number = 1", verb="run")),
    Way("deleted metrics of a result", 4, "metrics, events or trace digest",
        tampered("DELETE FROM metric WHERE run_number = 1")),
    Way("deleted verdict", 4, "tally", tampered("DELETE FROM verdict WHERE run_number = 1")),
    Way("deleted tally", 4, "tally", tampered("DELETE FROM tally WHERE fsr_id = 'FSR-06'")),
    Way("deleted block", 4, "work", tampered("DELETE FROM work")),
    Way("deleted block, run again", 4, "blocks cover 0 of 6",
        tampered("DELETE FROM work", verb="run")),
    Way("deleted planned case", 4, "campaign_case",
        tampered("DELETE FROM campaign_case WHERE ordinal = 2")),
    Way("FSR taken out of the plan", 4, "campaign_fsr",
        tampered("DELETE FROM campaign_fsr WHERE fsr_id = 'FSR-06'")),
    Way("altered metric", 4, "metric",
        tampered("UPDATE metric SET max_required_deceleration_mps2 = 0.5 WHERE run_number = 1")),
    Way("altered margin", 4, "verdict",
        tampered("UPDATE verdict SET margin = 99 WHERE run_number = 1")),
    Way("altered trace digest", 4, "run",
        tampered("UPDATE run SET trace_digest = '00' || substr(trace_digest, 3)")),
    Way("altered trace digest, replayed", 4, "trace", replay_of_altered_digest),
    Way("verdicts made green", 4, "verdict", verdict_made_green),
    Way("tally made green, run again", 4, "tally", tally_made_green),
    Way("tally made green and hashed again", 4, "tally", tally_hashed_again),
    Way("tally counted twice", 4, "tally", tampered("UPDATE tally SET runs = runs + 1")),
    Way("gate flag taken from the plan", 4, "campaign_fsr",
        tampered("UPDATE campaign_fsr SET mandatory = 0", verb="run")),
    Way("trigger dropped", 4, "tally_no_update", trigger_dropped),
    Way("view replaced", 4, "v_gate", view_replaced),
    Way("page of the database garbled", 4, "damaged", page_garbled),
    Way("one byte of the database flipped", 4, "camera_radar", page_of_a_value),
    Way("database file cut short", 4, "damaged", file_cut_short),
    Way("baseline edited by hand", 4, "was edited after it was written", baseline_edited),
    Way("plug-in that changes while it runs", 4, "was changed after", plugin_changed_midway),
]  # fmt: skip
