"""Masters in what drives: channels, sensors, switch and monitors."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from typing import TYPE_CHECKING, Any, Final

from adeye import api
from adeye.errors import AdeyeError
from adeye.report.formats.json import parse_json
from adeye.reporting import write_reports
from adeye.selftest.bench import (
    BARE,
    DB,
    DRIVING,
    GUARDED,
    HANDOVER,
    Bench,
    Edit,
    Examine,
    Group,
    Master,
    Seen,
    running,
)
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

# --- Masters in what drives: channels, sensors, switch and monitors -------------------------------

_OBJECT: Final = """\
    kind: radar
    mount: {x: 2.3 m, y: 0 m, z: 0.5 m}
    field_of_view: 120 deg
    range: 150 m
"""
_PLUGIN: Final = "    kind: ./parts.py:Front\n    parameters: {{flaw: {flaw}}}\n"


def _channel(flaw: str, wrong: str, fsr: str, finder: str) -> Master:
    return Master(
        flaw,
        "channel",
        wrong,
        f"{fsr}: {finder}",
        1,
        f"{fsr} FAIL",
        running(Edit(BARE, "flaw: none", f"flaw: {flaw}")),
        running(),
    )


def _sensor(name: str, wrong: str, finder: str, examine: Examine, twin: Examine) -> Master:
    fsr = finder.partition(":")[0]
    return Master(name, "sensor", wrong, finder, 1, f"{fsr} FAIL", examine, twin)


def _guarded(group: Group, name: str, wrong: str, finder: str, examine: Examine) -> Master:
    fsr = finder.partition(":")[0]
    twin = running(odd=HANDOVER)
    return Master(name, group, wrong, finder, 1, f"{fsr} FAIL", examine, twin)


def _fault(what: str, at: str = "1 s") -> Examine:
    """Plant a fault of the front sensor into every run."""
    fault = f"{{id: planted, target: sensors.front, onset: {{at: {at}}}, {what}}}"
    return running(
        Edit(DRIVING, "faults: []", f"faults: [{fault}]"),
        Edit(DRIVING, "faults: [none]", "faults: [planted]"),
    )


def _handover(fault: str, silent: str = "onset: {at: 2 s}", *edits: Edit) -> Examine:
    """Plant a fault beside the silence of the nominal channel."""
    return running(
        Edit(HANDOVER, "faults: [nominal_silent]", "faults: [[nominal_silent, planted]]"),
        Edit(HANDOVER, "onset: {at: 2 s}}]", f"{silent}}}, {{id: planted, {fault}}}]"),
        *edits,
        odd=HANDOVER,
    )


def _front(flaw: str, car: str = "none") -> Examine:
    return running(
        Edit(BARE, "flaw: none", f"flaw: {car}"),
        Edit(BARE, _OBJECT, _PLUGIN.format(flaw=flaw)),
        Edit(DRIVING, "use: closing", "use: closing_curve"),
    )


CHANNELS: Final = (
    _channel("never_brakes", "the channel never brakes", "FSR-01", "contact"),
    _channel("ignores", "the channel ignores every object", "FSR-01", "contact"),
    _channel("brakes_late", "the channel brakes late and hard", "FSR-02", "bound on a metric"),
    _channel(
        "steers_off", "the channel steers 0.02 rad to the left", "FSR-03", "place in the lane"
    ),
    _channel("oscillates", "the channel steers left and right", "FSR-04", "bound on the steering"),
    _channel("degrees", "the channel steers in degrees", "FSR-04", "bound on the steering"),
)

SENSORS: Final = (
    _sensor(
        "sensor_blind",
        "the sensor delivers nothing from 1 s on",
        "FSR-06: age of the sample",
        _fault("model: drop_out"),
        _fault("model: sample_loss, probability: 0.1"),
    ),
    _sensor(
        "sensor_short_range",
        "the sensor sees 25 m far, not 150 m",
        "FSR-05: detection",
        running(Edit(BARE, "range: 150 m", "range: 25 m")),
        running(Edit(BARE, "range: 150 m", "range: 120 m")),
    ),
    _sensor(
        "sensor_late",
        "samples come 0.5 s late",
        "FSR-06: age of the sample",
        running(Edit(BARE, "latency: 0.05 s", "latency: 0.5 s")),
        running(Edit(BARE, "latency: 0.05 s", "latency: 0.1 s")),
    ),
    _sensor(
        "sensor_frozen",
        "the sensor repeats its sample with new stamps",
        "FSR-01: contact",
        _fault("model: freeze"),
        _fault("model: freeze, duration: 0.1 s"),
    ),
    _sensor(
        "sensor_ghost",
        "the sensor reports an object in the lane that is not there",
        "FSR-07: braking without a reason",
        _fault("model: ghost, x: 20 m"),
        _fault("model: ghost, x: 20 m, y: 10 m"),
    ),
    _sensor(
        "sensor_turned",
        "the sensor is turned by 8 deg",
        "FSR-01: contact",
        _fault("model: miscalibration, yaw: 8 deg", "0 s"),
        _fault("model: miscalibration, yaw: 0.1 deg", "0 s"),
    ),
    _sensor(
        "sensor_mirrored",
        "bearings have the wrong sign, in a curve",
        "FSR-01: contact",
        _front("mirrored"),
        _front("none"),
    ),
    _sensor(
        "sensor_tampers",
        "the sensor writes into the world: the steering of a car that oscillates is straight",
        "FSR-04: bound on the steering; guests are shown copies",
        _front("tampering", "oscillates"),
        _front("none"),
    ),
)

SWITCHES: Final = (
    _guarded(
        "switch",
        "switch_stuck",
        "the switch never hands over",
        "FSR-12: time to authority",
        running(Edit(GUARDED, "policy: fixed_priority", "policy: stuck"), odd=HANDOVER),
    ),
    _guarded(
        "switch",
        "switch_late",
        "each handover takes effect 1 s late",
        "FSR-12: time to authority",
        _handover("target: switch, model: late, delay: 1 s, onset: {at: 0 s}"),
    ),
    _guarded(
        "switch",
        "switch_debounce",
        "a request must stand for 1 s, and a stale command may act",
        "FSR-12: time to authority",
        running(
            Edit(GUARDED, "debounce: 0 s", "debounce: 1 s"),
            Edit(GUARDED, "staleness: 0.3 s", "staleness: 5 s"),
            odd=HANDOVER,
        ),
    ),
    _guarded(
        "switch",
        "switch_chatter",
        "authority passes back and forth",
        "FSR-13: authority is kept",
        _handover(
            "target: channels.safety, model: silent, onset: {at: 4 s}, duration: 0.5 s, every: 1 s",
            "onset: {at: 2 s}, duration: 1 s",
            Edit(GUARDED, "latch: true", "latch: false"),
        ),
    ),
)

MONITORS: Final = (
    _guarded(
        "monitor",
        "monitors_frozen",
        "the monitors of the safety channel are frozen",
        "FSR-14: the monitor is confirmed",
        _handover("target: hooks.safety, model: monitors_frozen, onset: {at: 0 s}"),
    ),
    _guarded(
        "monitor",
        "safety_dead",
        "the safety channel is dead when it is needed",
        "FSR-12: time to authority",
        _handover("target: channels.safety, model: crash, onset: {at: 1 s}"),
    ),
)


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
