"""Masters in what is kept and told: a database altered or written over, an altered report."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from typing import TYPE_CHECKING, Any, Final

from adeye import api
from adeye.errors import AdeyeError
from adeye.report.json_report import parse_json
from adeye.reporting import write_reports
from adeye.selftest.bench import DB, Bench, Edit, Seen
from adeye.selftest.masters import Examine, Master
from adeye.selftest.project import BARE
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

_BAD: Final = (Edit(BARE, "flaw: none", "flaw: never_brakes"),)
"""What is altered: a campaign in which FSR-01 fails."""


def verified(path: Path) -> Seen:
    """Say what ``adeye db verify`` says."""
    with Repository.open(path, create=False) as repository:
        findings = repository.verify()
    return Seen(4 if findings else 0, "\n".join(map(str, findings)))


def replayed(path: Path) -> Seen:
    """Say what ``adeye replay`` says of the first run."""
    run = str(api.results(db=path).run.iloc[0])
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
            seen = Seen(error.exit_code, str(error))
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


def _database(name: str, wrong: str, words: str, statement: str) -> Master:
    return Master(
        name,
        "database",
        wrong,
        "adeye db verify",
        4,
        words,
        _altered(statement, verified),
        _altered("", verified),
    )


DATABASE: Final = (
    _database(
        "verdict_edited",
        "a verdict is changed from FAIL to PASS",
        ": altered",
        "UPDATE verdict SET verdict = 'PASS' WHERE run_number = 1 AND fsr_id = 'FSR-01'",
    ),
    _database(
        "run_deleted",
        "a run is deleted",
        "refers to a row that run does not have",
        "DELETE FROM run WHERE number = 1",
    ),
    _database(
        "tally_edited",
        "a tally counts one failed run more",
        "is not what its block counts to",
        "UPDATE tally SET runs = runs + 1 WHERE fsr_id = 'FSR-01'",
    ),
    _database(
        "metric_edited",
        "a metric is changed",
        "metrics, events or trace digest are not its own",
        "UPDATE metric SET min_distance_m = 5.0 WHERE run_number = 1",
    ),
    _database(
        "gate_edited",
        "an FSR is made optional after it judged",
        "campaign_fsr",
        "UPDATE campaign_fsr SET mandatory = 0 WHERE fsr_id = 'FSR-01'",
    ),
    _database(
        "trigger_dropped",
        "rows can be updated again",
        "verdict_no_update: is missing",
        "DROP TRIGGER verdict_no_update",
    ),
    Master(
        "replay_differs",
        "database",
        "the stored digest of a trace is of another run",
        "adeye replay",
        4,
        "not identical",
        _altered("UPDATE run SET trace_digest = 'f' || substr(trace_digest, 2)", replayed),
        _altered("", replayed),
    ),
    Master(
        "replay_by_the_clock",
        "database",
        "a channel steers by the clock of the computer, by less than 1e-6 rad",
        "adeye replay",
        4,
        "not identical",
        _twitching,
        _steady,
    ),
    Master(
        "output_onto_database",
        "database",
        "the JUnit file has the name of the database",
        "guard of outputs, before anything is written",
        2,
        "and would be overwritten",
        _written("kept.db"),
        _written("kept.xml"),
    ),
)


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
            return Seen(error.exit_code, str(error))
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


def _report(name: str, wrong: str, words: str, alter: Callable[[dict[str, Any]], None]) -> Master:
    finder = "record of the report, which refuses to contradict itself"
    return Master(name, "report", wrong, finder, 2, words, _reported(alter), _reported(_keep))


REPORT: Final = (
    _report(
        "report_verdict_flipped",
        "a verdict in the table is changed from FAIL to PASS",
        "PASS over a failed run",
        _flip_verdict,
    ),
    _report(
        "report_exit_code",
        "the exit code is 0 over a FAIL",
        "exit code 0, but the gate is",
        _flip_exit_code,
    ),
    _report(
        "report_fsr_left_out",
        "the FSR that fails is left out",
        "exit code 0, but the gate is",
        _drop_cells,
    ),
    _report(
        "report_pass_without_runs",
        "a PASS over no run",
        "PASS without a run that passed",
        _pass_without_runs,
    ),
)
