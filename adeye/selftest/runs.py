"""Masters in what drives: channels, sensors, switch and monitors."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any, Final

from adeye import api
from adeye.errors import AdeyeError, code_of
from adeye.report.formats.json import parse_json
from adeye.reporting import write_reports
from adeye.selftest.bench import (
    BARE,
    DB,
    Bench,
    Edit,
    Examine,
    Master,
    Seen,
    edited,
    master_of,
    written,
)
from adeye.store.repository import Repository

# --- Masters in what drives: channels, sensors, switch and monitors -------------------------------

CHANNELS: Final = tuple(edited(*item) for item in written("channel").items())
SENSORS: Final = tuple(edited(*item) for item in written("sensor").items())
SWITCHES: Final = tuple(edited(*item) for item in written("switch").items())
MONITORS: Final = tuple(edited(*item) for item in written("monitor").items())


# --- Masters in what is kept and told: a database altered or written over, an altered report ------

_BAD: Final = (Edit(BARE, "flaw: none", "flaw: never_brakes"),)
"""What is altered: a campaign in which FSR-01 fails."""


def verified(path: Path) -> Seen:
    """Say what ``adeye db verify`` says."""
    with Repository.open(path, create=False) as repository:
        findings = repository.verify()
    return Seen(4 if findings else 0, "\n".join(map(str, findings)))


def replayed(path: Path) -> Seen:
    """Say what ``adeye replay`` says of the first run."""
    with Repository.open(path, create=False) as repository:
        run = repository.find_run("0", campaign=repository.find_campaign().id).result_digest
    is_same = api.replay(run, db=path).identical
    return Seen(0 if is_same else 4, "identical" if is_same else "not identical")


def _twitching(bench: Bench) -> Seen:
    """Execute a run again whose channel steers by the clock of the computer."""
    edits = (Edit(BARE, "flaw: none", "flaw: by_the_clock"),)
    seen = bench.run(edits)
    # Nothing else must be wrong with it, or this would not be the reason.
    return replayed(bench.settle(edits) / DB) if seen.exit_code == 0 else seen


def _steady(bench: Bench) -> Seen:
    bench.run(())
    return replayed(bench.settle(()) / DB)


def _altered(statement: str, look: Callable[[Path], Seen]) -> Examine:
    """Alter a copy of the database as somebody with a tool does, triggers and all."""

    def examine(bench: Bench) -> Seen:
        bench.run(_BAD)
        copy = _copy(bench, "altered.db")
        with closing(sqlite3.connect(copy)) as connection:
            _execute(connection, statement)
        return look(copy)

    return examine


def _copy(bench: Bench, name: str) -> Path:
    copy = bench.folder / name
    copy.unlink(missing_ok=True)
    source = bench.settle(_BAD) / DB
    with closing(sqlite3.connect(source)) as old, closing(sqlite3.connect(copy)) as new:
        old.backup(new)
    return copy


def _written(name: str) -> Examine:
    """Write the JUnit file of a copy of the database to a name beside it."""

    def examine(bench: Bench) -> Seen:
        bench.run(_BAD)
        copy = _copy(bench, "kept.db")
        try:
            write_reports(copy, None, junit=copy.with_name(name))
        except AdeyeError as error:
            seen = Seen(code_of(error), str(error))
        else:
            seen = Seen(0, "written")
        # A refusal that comes too late is none.
        kept = verified(copy)
        return kept if kept.exit_code else seen

    return examine


def _execute(connection: sqlite3.Connection, statement: str) -> None:
    triggers = connection.execute(
        "SELECT name, sql FROM sqlite_master WHERE type = 'trigger'"
    ).fetchall()
    for name, _ in triggers:
        connection.execute(f"DROP TRIGGER {name}")
    is_row = statement.startswith(("UPDATE", "DELETE"))
    if is_row and connection.execute(statement).rowcount < 1:
        msg = f"{statement} changes nothing"
        raise ValueError(msg)
    for _, ddl in triggers:
        connection.execute(ddl)
    if statement and not is_row:
        connection.execute(statement)
    connection.commit()


def _database(name: str, item: dict[str, Any]) -> Master:
    if "statement" not in item:
        return master_of(name, item, *_NOT_ALTERED[name])
    look = replayed if item["finder"] == "adeye replay" else verified
    return master_of(name, item, _altered(item["statement"], look), _altered("", look))


_NOT_ALTERED: Final = {
    "replay_by_the_clock": (_twitching, _steady),
    "output_onto_database": (_written("kept.db"), _written("kept.xml")),
}
"""What takes a master through the production path that alters no database."""

DATABASE: Final = tuple(_database(*item) for item in written("database").items())


def _reported(alter: Callable[[dict[str, Any]], None]) -> Examine:
    """Alter the report of a campaign and read it back."""

    def examine(bench: Bench) -> Seen:
        bench.run(_BAD)
        folder = bench.settle(_BAD)
        path = folder / "report.json"
        if not path.exists():
            write_reports(folder / DB, None, json=path)
        document = json.loads(path.read_text("utf-8"))
        alter(document)
        try:
            parse_json(json.dumps(document))
        except AdeyeError as error:
            return Seen(code_of(error), str(error))
        return Seen(0, "it holds together")

    return examine


def _failed(document: dict[str, Any]) -> list[dict[str, Any]]:
    """Cells of the FSR that fails; there are some, or the master is none."""
    cells = [cell for cell in document["cells"] if cell["verdict"] == "FAIL"]
    if not cells:
        msg = "no cell of the report fails"
        raise ValueError(msg)
    return cells


def _flip_verdict(document: dict[str, Any]) -> None:
    for cell in _failed(document):
        cell["verdict"] = "PASS"


def _flip_exit_code(document: dict[str, Any]) -> None:
    document["exit_code"] = 0


def _drop_cells(document: dict[str, Any]) -> None:
    gone = {cell["fsr"] for cell in _failed(document)}
    for cell in document["cells"]:
        if cell["fsr"] not in gone:
            cell["verdict"], cell["counts"] = "PASS", {"PASS": cell["runs"]}
    document["cells"] = [cell for cell in document["cells"] if cell["fsr"] not in gone]
    document["exit_code"] = 0


def _pass_without_runs(document: dict[str, Any]) -> None:
    for cell in _failed(document):
        cell |= {"verdict": "PASS", "counts": {}, "runs": 0, "exercised": 0}


def _keep(document: dict[str, Any]) -> None:
    document["message"] = f"{document['message']} "


_ALTERATIONS: Final = {
    "report_verdict_flipped": _flip_verdict,
    "report_exit_code": _flip_exit_code,
    "report_fsr_left_out": _drop_cells,
    "report_pass_without_runs": _pass_without_runs,
}
REPORT: Final = tuple(
    master_of(name, item, _reported(_ALTERATIONS[name]), _reported(_keep))
    for name, item in written("report").items()
)
