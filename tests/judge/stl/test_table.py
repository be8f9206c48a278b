"""Tables as sources of signals: what is read, and what is refused with its place."""

from __future__ import annotations

import importlib.util
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest

from adeye.errors import InputError
from adeye.judge.stl.table import Table, TableSignals, read_table, sampling, table_of, time_column

if TYPE_CHECKING:
    from pathlib import Path

EVEN = [0.0, 0.1, 0.2, 0.3]


@pytest.fixture
def write(tmp_path: Path) -> Any:
    def file(text: str | bytes, name: str = "drive.csv") -> Path:
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return file


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_columns_are_read_whatever_separates_them(write: Any, mark: str) -> None:
    table = read_table(write("\ufefftime, gap \n0,1.5\n1, 2\n\n".replace(",", mark)))
    assert table.columns == {"time": ["0", "1"], "gap": ["1.5", "2"]}
    assert table.lines == [2, 3]
    assert table.rows == 2
    assert table.place(1) == "line 3"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no line of column names"),
        ("time,gap,gap\n0,1,2\n", "csv:1:2: column 'gap' occurs twice"),
        ("time,gap\n0,1\n1\n", "csv:3:1: a row of 1 cells, and 2 columns"),
        ("time,gap\n0,1\n\n1,2\n", "csv:3:1: a row of 0 cells, and 2 columns"),
        ('time,gap\n0,"1\n', "not a CSV file"),
        (b"time,g\xe4p\n0,1\n", "not text in UTF-8"),
    ],
)
def test_what_is_no_table_is_refused(write: Any, text: Any, message: str) -> None:
    with pytest.raises(InputError) as caught:
        read_table(write(text))
    assert message in str(caught.value)


def test_a_file_that_is_not_there_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_table(tmp_path / "none.csv")


def test_parquet_is_read_by_pandas_or_says_what_is_missing(write: Any) -> None:
    has_reader = importlib.util.find_spec("pyarrow") or importlib.util.find_spec("fastparquet")
    message = "cannot be read" if has_reader else r"needs pyarrow.*save the table as CSV"
    with pytest.raises(InputError, match=message):
        read_table(write(b"PAR1", "drive.parquet"))


def test_a_data_frame_is_a_table() -> None:
    frame = pd.DataFrame({"t": EVEN, "mode": ["ok", "ok", "bad", "ok"], "on": [True] * 4})
    signals = TableSignals(table_of(frame))
    assert signals.series("mode").labels == ("bad", "ok")
    assert signals.series("on").values.tolist() == [[1.0] * 4]
    with pytest.raises(InputError, match="unequal lengths"):
        table_of({"t": [1, 2], "gap": [1]})


# --- times


def test_the_column_of_times_is_found_or_named() -> None:
    assert time_column(Table("x", {"gap": [], "time_s": []})) == "time_s"
    assert time_column(Table("x", {"gap": [], "time_s": []}), "gap") == "gap"
    with pytest.raises(InputError, match="no column time, time_s, t"):
        time_column(Table("x", {"gap": []}))
    with pytest.raises(InputError, match="no column 'tme'"):
        time_column(Table("x", {"time": []}), "tme")


@pytest.mark.parametrize(
    ("times", "unit", "step"),
    [
        (EVEN, "s", 0.1),
        ([5, 105, 205], "ms", 0.1),
        # 30 rows a second, written with three digits.
        ([round(k / 30, 3) for k in range(30)], "s", 1 / 30),
        ([0, 2, 4], "s", 2.0),
        ([0.0, 0.4, 0.8], "s", 0.4),
        (["0", " 0.5", "1.0"], "s", 0.5),
        # A tenth of a step, but for the last bits.
        ([0.02, 0.04, 0.06, 0.078, 0.1, 0.12], "s", 0.02),
    ],
)
def test_the_step_is_that_of_the_times(times: list[Any], unit: str, step: float) -> None:
    found, measured, _ = sampling(Table("x", {"t": times}), "t", unit)
    assert measured == step
    assert found[-1] - found[0] == pytest.approx(step * (len(times) - 1), rel=2e-3)


@pytest.mark.parametrize(
    ("times", "line", "message"),
    [
        ([0, 1, 1, 2], 4, "time 1 s does not come after 1 s"),
        ([0, 2, 1, 3], 4, "time 1 s does not come after 2 s"),
        ([0, 1, 2, 4, 5], 5, "2 s after the row before, where 1 s are usual"),
        ([0, 1, "", 3], 4, "'' is not a time"),
        ([0, 1, "nan"], 4, "'nan' is not a time"),
        ([0, 1, "1_0"], 4, "'1_0' is not a time"),
        ([0, *np.cumsum([1.0] * 20 + [1.09] * 20)], 5, "is off an even spacing"),
    ],
)
def test_times_that_are_not_even_are_refused_at_their_row(
    times: list[Any], line: int, message: str
) -> None:
    table = Table("drive.csv", {"t": times}, range(2, 2 + len(times)))
    with pytest.raises(InputError) as caught:
        sampling(table, "t")
    assert message in str(caught.value)
    assert f"drive.csv:{line}:1:" in str(caught.value)


def test_a_row_without_a_line_is_numbered() -> None:
    with pytest.raises(InputError, match="the table, row 2: time 0 s does not come after 1 s"):
        sampling(table_of({"t": [1.0, 0.0]}), "t")


def test_one_row_and_a_unit_of_something_else_are_refused() -> None:
    with pytest.raises(InputError, match="fewer than 2 rows"):
        sampling(Table("x", {"t": [1]}), "t")
    with pytest.raises(InputError, match="'m' is not a unit of time"):
        sampling(Table("x", {"t": [1, 2]}), "t", "m")


# --- columns


def signals(cells: list[Any], **options: Any) -> TableSignals:
    return TableSignals(Table("x.csv", {"a": cells}, range(2, 2 + len(cells))), **options)


def test_numbers_become_si() -> None:
    series = signals(["36", "", "7.2"], units={"a": "km/h"}).series("a")
    assert (series.unit, series.kind, series.scale) == ("m/s", "number", 1.0)
    assert np.array_equal(series.values, [[10.0, np.nan, 2.0]], equal_nan=True)
    assert signals(["1"], units={"a": "1"}).series("a").unit == "1"


def test_truth_values_and_words_are_told_from_the_cells() -> None:
    truth = signals(["true", "False", ""]).series("a")
    assert truth.kind == "boolean"
    assert np.array_equal(truth.values, [[1.0, 0.0, np.nan]], equal_nan=True)
    words = signals(["ok", "", "bad"]).series("a")
    assert (words.kind, words.labels) == ("enumeration", ("bad", "ok"))
    assert np.array_equal(words.values, [[1.0, np.nan, 0.0]], equal_nan=True)
    declared = signals(["1", "2"], words={"a": ["1", "2", "3"]}).series("a")
    assert declared.labels == ("1", "2", "3")


@pytest.mark.parametrize(
    ("cells", "options", "message"),
    [
        (["1", "two", "3"], {}, "x.csv:3:1: 'two' among the numbers of column 'a'"),
        (["true", "nan", "false"], {}, "x.csv:3:1: 'nan' among the words of column 'a'"),
        (["red", "NaN", ""], {}, "x.csv:3:1: 'NaN' among the words of column 'a'"),
        (["ok", "odd"], {"words": {"a": ["ok"]}}, "x.csv:3:1: 'odd' is none of the words ok"),
        (["1"], {"units": {"a": "furlong"}}, "'furlong' is not a unit"),
        (["ok"], {"units": {"a": "m"}}, "has the words ok, and no unit"),
    ],
)
def test_a_column_that_makes_no_sense_is_refused(
    cells: list[str], options: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError) as caught:
        signals(cells, **options).series("a")
    assert message in str(caught.value)


def test_what_is_told_of_a_column_that_is_not_there_is_refused() -> None:
    with pytest.raises(InputError, match="no column 'b'"):
        signals(["1"], units={"b": "m"})


def test_the_first_missing_sample_is_named() -> None:
    table = Table("x", {"a": ["1", "2", ""], "b": ["1", "inf", "3"]}, [2, 3, 4])
    assert TableSignals(table).missing(["a", "b"]) == (
        "line 3: b is inf, which is no finite number"
    )
    assert TableSignals(table).missing(["a"]) == "line 4: a is empty"
    assert TableSignals(table_of({"c": [1.0]})).missing(["c"]) is None


HIDDEN = [False, False, True, False]


@pytest.mark.parametrize(
    "column",
    [
        np.ma.array([9.0, 9.0, 0.0, 9.0], mask=HIDDEN),
        np.ma.array([9, 9, 0, 9], mask=HIDDEN),
        np.ma.array([True, True, False, True], mask=HIDDEN),
        np.ma.array(["a", "a", "b", "a"], mask=HIDDEN),
        [9.0, 9.0, np.ma.masked, 9.0],
        [9, 9, None, 9],
        np.array([9, 9, pd.NA, 9], dtype=object),
        np.array(["a", "a", np.nan, "a"], dtype=object),
        pd.array([9, 9, None, 9], dtype="Int64"),
        pd.array([9.0, 9.0, None, 9.0], dtype="Float64"),
        pd.array([True, True, None, True], dtype="boolean"),
        pd.array(["a", "a", None, "a"], dtype="string"),
        pd.Categorical(["a", "a", None, "a"]),
    ],
)
def test_what_is_hidden_or_not_there_is_no_sample(column: Any) -> None:
    signals = TableSignals(table_of({"x": column}))
    assert np.isfinite(signals.series("x").values[0]).tolist() == [True, True, False, True]
    assert (signals.missing(["x"]) or "").startswith("row 3: x is ")


def test_hidden_time_is_no_time() -> None:
    table = table_of({"time": np.ma.array([0.0, 1.0, 2.0, 3.0], mask=HIDDEN)})
    with pytest.raises(InputError, match="row 3: None is not a time"):
        sampling(table, "time")


@pytest.mark.parametrize("unit", ["ns", "us", "ms"])
@pytest.mark.parametrize("begin", [None, "2024-01-01"])
def test_stamps_are_seconds_whatever_they_count(unit: Any, begin: str | None) -> None:
    times = pd.to_timedelta(np.arange(4) * 100, unit="ms").as_unit(unit)
    stamps = times if begin is None else pd.Timestamp(begin).as_unit(unit) + times
    table = table_of(pd.DataFrame({"time": stamps, "gap": EVEN}))
    assert table.cells("time") == pytest.approx(EVEN)


def test_digits_of_other_scripts_are_no_numbers(write: Any) -> None:
    signals = TableSignals(read_table(write("a,b,c\n\uff15,1_0,7\n")))
    assert [signals.series(name).labels for name in "abc"] == [("\uff15",), ("1_0",), ()]
