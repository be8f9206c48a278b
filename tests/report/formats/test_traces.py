"""The signals of a run as a table: what formulas are told, with units, a row a tick."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from adeye.errors import UsageError
from adeye.judge.trace_signals import TraceSignals
from adeye.report.formats.tables import FORMATS, FileFormat
from adeye.report.formats.traces import form_of, write_trace_table
from tests.judge.conftest import HandMade


@pytest.fixture
def signals() -> TraceSignals:
    """Two runs; the second ends by contact, and its safety channel fails at row 2."""
    made = HandMade(runs=2, rows=9, tail_rows=1).ego(heading=0.1).touch(6, "lead", run=1)
    made.columns["acceleration"][1, 2, 1] = np.nan
    made.columns["status"][1, 2, 1] = 3
    return TraceSignals(made.trace(), np.ones(2, dtype=np.bool_))


def written(signals: TraceSignals, folder: Path, form: FileFormat) -> Path:
    path = folder / f"run.{form}"
    write_trace_table(signals, 1, {"run": "ab"}, path, form_of(path))
    return path


def test_parquet_has_every_signal_with_unit_and_meaning(
    signals: TraceSignals, tmp_path: Path
) -> None:
    table = pq.read_table(written(signals, tmp_path, "parquet"))
    assert len(table) == 7
    assert len(table.column_names) == len(set(table.column_names)) == len(signals.dictionary)
    about = json.loads(table.schema.metadata[b"adeye"])
    assert (about["run"], about["schema"]) == ("ab", "adeye/trace-table@1")
    speed = table.schema.field("ego_speed_mps").metadata
    assert (speed[b"unit"], speed[b"description"]) == (b"m/s", b"speed")
    for name, column in (("ego.x", "ego_x_m"), ("actor.lead.gap", "actor_lead_gap_m")):
        np.testing.assert_array_equal(table[column], signals.series(name).values[1, :7])


def test_values_that_are_none_are_empty(signals: TraceSignals, tmp_path: Path) -> None:
    table = pq.read_table(written(signals, tmp_path, "parquet")).to_pydict()
    # Failed at row 2, and nothing is decided at the last row.
    assert table["channel_safety_acceleration_mps2"] == [0.0, 0.0, None, 0.0, 0.0, 0.0, None]
    assert table["channel_safety_status"][1:4] == ["ok", "fault", "ok"]
    assert table["contact"] == [False] * 6 + [True]
    # Nobody is approached: there is no conflict, and so no time to one.
    assert table["ttc_s"][0] is None


@pytest.mark.parametrize("form", FORMATS)
def test_same_run_gives_the_same_bytes(signals: TraceSignals, tmp_path: Path, form: Any) -> None:
    one = written(signals, tmp_path, form).read_bytes()
    assert one == written(signals, tmp_path, form).read_bytes()


def test_text_forms_hold_the_same(signals: TraceSignals, tmp_path: Path) -> None:
    with written(signals, tmp_path, "csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    lines = written(signals, tmp_path, "jsonl").read_text("utf-8").splitlines()
    wanted = signals.series("ego.x").values[1, :7].tolist()
    assert [float(row["ego_x_m"]) for row in rows] == wanted
    assert [json.loads(line)["ego_x_m"] for line in lines] == wanted


def test_name_without_a_form_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="ends in no form"):
        form_of(tmp_path / "run.txt")
