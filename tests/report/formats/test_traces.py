"""The signals of a run as a table: what formulas are told, with units, a row a tick."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from adeye.errors import UsageError
from adeye.judge.trace_signals import TraceSignals
from adeye.report.formats.traces import (
    FORMS,
    TraceTable,
    chosen_signals,
    form_of,
    trace_table,
    write_trace_table,
)
from tests.judge.conftest import HandMade


@pytest.fixture
def signals() -> TraceSignals:
    """Two runs; the second ends by contact, and its safety channel fails at row 2."""
    made = HandMade(runs=2, rows=9, tail_rows=1).ego(heading=0.1).touch(6, "lead", run=1)
    made.columns["acceleration"][1, 2, 1] = np.nan
    made.columns["status"][1, 2, 1] = 3
    return TraceSignals(made.trace(), np.ones(2, dtype=np.bool_))


@pytest.fixture
def table(signals: TraceSignals) -> TraceTable:
    return trace_table(signals, 1, {"run": "ab"})


def written(table: TraceTable, folder: Path, form: str) -> Path:
    path = folder / f"run.{form}"
    write_trace_table(table, path, form_of(path))
    return path


def test_parquet_has_every_signal_with_unit_and_meaning(
    signals: TraceSignals, table: TraceTable, tmp_path: Path
) -> None:
    path = written(table, tmp_path, "parquet")
    read = pq.read_table(path)
    assert len(read) == 7
    assert read.column_names[: len(signals.dictionary)] == list(signals.dictionary)
    assert all(name.endswith(".status") for name in read.column_names[len(signals.dictionary) :])
    about = json.loads(read.schema.metadata[b"adeye"])
    assert (about["run"], about["schema"]) == ("ab", "adeye/trace-table@2")
    speed = read.schema.field("ego.speed").metadata
    assert (speed[b"unit"], speed[b"description"]) == (b"m/s", b"speed")
    for name in ("ego.x", "actor.lead.gap"):
        np.testing.assert_array_equal(read[name], signals.series(name).values[1, :7])
    assert pd.read_parquet(path).attrs == about


def test_values_that_are_none_are_empty_and_say_why(table: TraceTable, tmp_path: Path) -> None:
    read = pq.read_table(written(table, tmp_path, "parquet")).to_pydict()
    # Failed at row 2, and nothing is decided at the last row.
    commanded = "channel.safety.acceleration"
    assert read[commanded] == [0.0, 0.0, None, 0.0, 0.0, 0.0, None]
    assert read[f"{commanded}.status"][1:] == [
        "value", "error", "value", "value", "value", "not_applicable",
    ]  # fmt: skip
    assert read["channel.safety.status"][1:4] == ["ok", "fault", "ok"]
    assert read["contact"] == [False] * 6 + [True]
    # Nobody is approached: there is no conflict, and so no time to one.
    assert (read["ttc"][0], read["ttc.status"][0]) == (None, "no_conflict")
    assert "ego.speed.status" not in read


@pytest.mark.parametrize("form", FORMS)
def test_same_run_gives_the_same_bytes(table: TraceTable, tmp_path: Path, form: Any) -> None:
    one = written(table, tmp_path, form).read_bytes()
    assert one == written(table, tmp_path, form).read_bytes()


def test_other_forms_hold_the_same(
    signals: TraceSignals, table: TraceTable, tmp_path: Path
) -> None:
    with written(table, tmp_path, "csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    lines = written(table, tmp_path, "jsonl").read_text("utf-8").splitlines()
    wanted = signals.series("ego.x").values[1, :7].tolist()
    assert [float(row["ego.x [m]"]) for row in rows] == wanted
    assert rows[0]["switch.reason [{}]".format("|".join(table.told["words"]["switch.reason"]))]
    assert [json.loads(line)["ego.x"] for line in lines] == wanted
    with np.load(written(table, tmp_path, "npz")) as stored:
        assert stored["ego.x"].tolist() == wanted
        assert stored["contact"].dtype == np.bool_
        assert stored["authority.nominal"].tolist()[-2:] == ["true", ""]
        assert json.loads(str(stored["about"])) == table.told


def test_frame_is_typed_and_knows_its_units(table: TraceTable) -> None:
    frame = table.frame()
    kinds = {name: str(frame[name].dtype) for name in ("ego.speed", "contact", "switch.reason")}
    assert kinds["ego.speed"] == "float64"
    assert kinds["contact"] == "boolean"
    assert kinds["switch.reason"].startswith("str")
    assert frame.attrs["units"]["ego.acceleration"] == "m/s²"
    assert frame.attrs["horizon"] == "0.7 s"


def test_chosen_signals_come_with_the_time(signals: TraceSignals) -> None:
    chosen = trace_table(signals, 0, {}, ["ego.s*", "ttc"])
    assert [item.name for item in chosen.columns][:4] == [
        "time", "ego.speed", "ego.steering_angle", "ego.speed_limit",
    ]  # fmt: skip


def test_signal_that_is_not_there_is_refused() -> None:
    known = ["time", "ego.speed", "ttc"]
    with pytest.raises(UsageError, match=r"no signal 'ego.sped'.*ego\.speed"):
        chosen_signals(known, ["ttc", "ego.sped"])
    with pytest.raises(UsageError, match="adeye signals"):
        chosen_signals(known, ["*zz*"])


def test_name_without_a_form_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="ends in no form"):
        form_of(tmp_path / "run.txt")
