"""Tables as sources of signals and formulas on them: what is read, judged and refused."""

import importlib.util
import json
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from adeye.errors import InputError
from adeye.judge.stl.batch import SATISFIED, VIOLATED, evaluate_columns
from adeye.judge.stl.formula import parse_formula
from adeye.judge.stl.series import Series
from adeye.judge.stl.table import (
    TRACE_TABLE,
    JudgedTable,
    Reading,
    Table,
    TableSignals,
    judge_table,
    read_table,
    sampling,
    table_of,
    time_column,
)
from adeye.judge.verdict import Verdict
from adeye.kernel.relation import TIME_SLACK, tick_times
from tests.refusals import refused
from tests.stored import stored

TABLES = stored("formulas")


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


def test_what_is_no_table_is_refused(write: Any) -> None:
    for text, message in (
        ("", "no line of column names"),
        ("time,gap,gap\n0,1,2\n", "csv:1:2: column 'gap' occurs twice"),
        ("time,gap\n0,1\n1\n", "csv:3:1: a row of 1 cells, and 2 columns"),
        ("time,gap\n0,1\n\n1,2\n", "csv:3:1: a row of 0 cells, and 2 columns"),
        ('time,gap\n0,"1\n', "not a CSV file"),
        (b"time,g\xe4p\n0,1\n", "not text in UTF-8"),
    ):
        refused(InputError, read_table, write(text), says=message)


def test_a_file_that_is_not_there_is_an_input_error(tmp_path: Path) -> None:
    refused(InputError, read_table, tmp_path / "none.csv", says="cannot be read")


def test_parquet_is_read_by_pandas_or_says_what_is_missing(write: Any) -> None:
    has_reader = importlib.util.find_spec("pyarrow") or importlib.util.find_spec("fastparquet")
    message = "cannot be read" if has_reader else r"needs pyarrow.*save the table as CSV"
    refused(InputError, read_table, write(b"PAR1", "drive.parquet"), says=message)


def test_a_data_frame_is_a_table() -> None:
    frame = pd.DataFrame({"t": EVEN, "mode": ["ok", "ok", "bad", "ok"], "on": [True] * 4})
    signals = TableSignals(table_of(frame))
    assert signals.series("mode").labels == ("bad", "ok")
    assert signals.series("on").values.tolist() == [[1.0] * 4]
    refused(InputError, table_of, {"t": [1, 2], "gap": [1]}, says="unequal lengths")
    series = pd.Series([10.0, 9.91], index=[0.0, 0.1])
    refused(InputError, table_of, series, says="is no table")
    for twice in ({"t": EVEN, 1: EVEN, "1": EVEN}, pd.concat([frame, frame], axis=1)):
        refused(InputError, table_of, twice, says="occurs twice")


ODD = 2**53 + 1
"""A whole number that no float is."""


@pytest.mark.parametrize("unit", ["M", "Y", "generic"])
@pytest.mark.parametrize("column", ["time", "n"])
def test_months_and_years_are_no_seconds(column: str, unit: str) -> None:
    kind = "timedelta64" if unit == "generic" else f"timedelta64[{unit}]"
    columns = {"time": [0, 1], "n": [0, 1]} | {column: np.array([0, 1]).astype(kind)}
    refused(InputError, table_of, columns, says="has no length in seconds")
    dates = np.array(["2020-01", "2020-02"], dtype="datetime64[M]")
    month = table_of({"time": dates, "n": [0, 1]})
    assert month.columns["time"][1] == 31 * 86_400


@pytest.mark.parametrize(
    "values",
    [
        [1, ODD],
        [1, -ODD],
        np.array([1, ODD]),
        np.array([1, ODD], dtype=np.uint64),
        np.array([1, 2**64 - 1], dtype=np.uint64),
        np.array([1, ODD], dtype=np.longdouble),
        np.ma.array([1, ODD], mask=[True, False]),
        np.array([np.int64(1), np.int64(ODD)], dtype=object),
        pd.Series([1, ODD]),
        pd.Series([None, ODD], dtype="Int64"),
        pd.Series([None, ODD], dtype="Int64").astype("category"),
        pd.Series([1, ODD], dtype=pd.SparseDtype("int64")),
        [Decimal(1), Decimal(ODD)],
        ["1", str(ODD)],
        ["1", f"{ODD}.0"],
        ["1", f"+{ODD // 10}.{ODD % 10}e1"],
        ["1", "123456789012345680000"],
    ],
    ids=str,
)
@pytest.mark.parametrize("formula", ["always(n > 0)", "eventually(n == 9007199254740992)"])
def test_whole_numbers_that_no_float_holds_are_refused_at_their_row(
    values: Any, formula: str
) -> None:
    table = table_of({"time": [0, 1], "n": values})
    caught = refused(InputError, judge_table, formula, table, Reading(), says="would be rounded")
    assert "the table, row 2: " in str(caught)
    assert "in column 'n'" in str(caught)
    assert judge_table("always(time >= 0)", table, Reading()), "who reads it not may have it"


def test_whole_numbers_of_files_are_refused_at_their_row(write: Any, tmp_path: Path) -> None:
    text = f"time,limit,n\n0,1,1\n1,2,{ODD}\n"
    table = read_table(write(text))
    caught = refused(InputError, judge_table, "always(n > limit)", table, Reading())
    assert "drive.csv:3:3: " in str(caught)
    if importlib.util.find_spec("pyarrow"):
        path = tmp_path / "drive.parquet"
        frame = pd.DataFrame({"time": [0, 1], "n": pd.array([None, ODD], dtype="Int64")})
        frame.to_parquet(path)
        table = read_table(path)
        refused(InputError, judge_table, "always(n > 1)", table, Reading(), says="row 2: ")


def test_times_that_no_float_holds_are_refused() -> None:
    table = table_of({"time": [ODD - 1, ODD, ODD + 1], "gap": [1, 2, 3]})
    refused(InputError, judge_table, "always(gap > 0)", table, Reading(), says="row 2: ")


@pytest.mark.parametrize(
    "values",
    [
        [2**53, -(2**53)],
        [2**60, 2.0**70],
        [1e23, 0.1],
        ["1e23", "1.2345678901234567e+17"],
        np.array([2.0**53 + 2, 1e300]),
        [*map(repr, np.random.default_rng(3).uniform(1e15, 1e18, 400).tolist())],
    ],
    ids=str,
)
def test_what_a_float_holds_or_is_no_more_than_a_float_is_read(values: Any) -> None:
    table = table_of({"time": list(range(len(values))), "n": values})
    assert judge_table("always(n > -1e16)", table, Reading()).verdict is not Verdict.ERROR


@pytest.mark.parametrize("number", [f"{ODD}", f"-{ODD}", f"{ODD}.0", f"{ODD} m", f"{ODD}/3"])
def test_formulas_and_parameters_have_no_number_that_no_float_holds(number: str) -> None:
    table = table_of({"time": [0, 1], "n": [1, 2]})
    units = {"n": "m"} if number.endswith("m") else {}
    said = {"says": "would be rounded"}
    refused(InputError, judge_table, f"always(n < {number})", table, Reading(units=units), **said)
    if "/" not in number:
        given = Reading(units=units, parameters={"most": number})
        refused(InputError, judge_table, "always(n < most)", table, given, **said)
    given = Reading(parameters={"most": ODD})
    refused(InputError, judge_table, "always(n < most)", table, given, **said)


# --- times


def test_the_column_of_times_is_found_or_named() -> None:
    assert time_column(Table("x", {"gap": [], "time_s": []})) == "time_s"
    assert time_column(Table("x", {"gap": [], "time_s": []}), "gap") == "gap"
    refused(InputError, time_column, Table("x", {"gap": []}), says="no column time, time_s, t")
    refused(InputError, time_column, Table("x", {"time": []}), "tme", says="no column 'tme'")


def test_the_step_is_that_of_the_times() -> None:
    for times, unit, step in (
        (EVEN, "s", 0.1),
        ([5, 105, 205], "ms", 0.1),
        # 30 rows a second, written with three digits.
        ([round(k / 30, 3) for k in range(30)], "s", 1 / 30),
        ([0, 2, 4], "s", 2.0),
        ([0.0, 0.4, 0.8], "s", 0.4),
        (["0", " 0.5", "1.0"], "s", 0.5),
        # A tenth of a step, but for the last bits.
        ([0.02, 0.04, 0.06, 0.078, 0.1, 0.12], "s", 0.02),
    ):
        found, measured, _ = sampling(Table("x", {"t": times}), "t", unit)
        assert measured == step, times
        assert found[-1] - found[0] == pytest.approx(step * (len(times) - 1), rel=2e-3)


def test_times_that_are_not_even_are_refused_at_their_row() -> None:
    for times, line, message in (
        ([0, 1, 1, 2], 4, "time 1 s does not come after 1 s"),
        ([0, 2, 1, 3], 4, "time 1 s does not come after 2 s"),
        ([0, 1, 2, 4, 5], 5, "2 s after the row before, where 1 s are usual"),
        ([0, 1e-320, 2e-320], 3, "s apart, not 1e-09 s to 1e+06 s"),
        ([0, 1e300], 3, "rows are 1e+300 s apart, not 1e-09 s to 1e+06 s"),
        ([0, 1, "", 3], 4, "'' is not a time"),
        ([0, 1, "nan"], 4, "'nan' is not a time"),
        ([0, 1, "1_0"], 4, "'1_0' is not a time"),
        ([0, *np.cumsum([1.0] * 20 + [1.09] * 20)], 5, "is off an even spacing"),
    ):
        table = Table("drive.csv", {"t": times}, range(2, 2 + len(times)))
        caught = refused(InputError, sampling, table, "t", says=message)
        assert f"drive.csv:{line}:1:" in str(caught)


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


def test_a_column_that_makes_no_sense_is_refused() -> None:
    for cells, options, message in TABLES["a column that makes no sense is refused"]:
        refused(InputError, signals(cells, **options).series, "a", says=message)


def test_what_is_told_of_a_column_that_is_not_there_is_refused() -> None:
    refused(InputError, signals, ["1"], units={"b": "m"}, says="no column 'b'")


def test_the_first_missing_sample_is_named() -> None:
    table = Table("x", {"a": ["1", "2", ""], "b": ["1", "inf", "3"]}, [2, 3, 4])
    assert TableSignals(table).missing(["a", "b"]) == (
        "line 3: b is inf, which is no finite number"
    )
    assert TableSignals(table).missing(["a"]) == "line 4: a is empty"
    assert TableSignals(table_of({"c": [1.0]})).missing(["c"]) is None


HIDDEN = [False, False, True, False]


def test_what_is_hidden_or_not_there_is_no_sample() -> None:
    for column in (
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
    ):
        signals = TableSignals(table_of({"x": column}))
        assert np.isfinite(signals.series("x").values[0]).tolist() == [True, True, False, True]
        assert (signals.missing(["x"]) or "").startswith("row 3: x is "), column


def test_hidden_time_is_no_time() -> None:
    table = table_of({"time": np.ma.array([0.0, 1.0, 2.0, 3.0], mask=HIDDEN)})
    refused(InputError, sampling, table, "time", says="row 3: None is not a time")


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


COLUMNS = {
    "time": [10.0, 10.1, 10.2, 10.3],
    "gap": [9.0, 5.0, 3.0, 4.0],
    "brake": [False, False, True, True],
    "mode": ["ok", "ok", "ok", "degraded"],
}


def judged(formula: str, **reading: Any) -> JudgedTable:
    return judge_table(formula, table_of(COLUMNS), Reading(**reading))


def test_a_violation_has_place_value_and_threshold_in_its_unit() -> None:
    found = judged("always(gap > 4 m)", units={"gap": "m"})
    item = found.judgement
    assert found.verdict is Verdict.FAIL
    assert (item.time_s, item.value, item.threshold, item.margin, item.unit) == (
        10.2, 3.0, 4.0, -1.0, "m",
    )  # fmt: skip
    assert found.robustness_low.tolist() == [-1.0, -1.0, -1.0, 0.0]
    assert found.step_s == 0.1
    assert found.horizon_s == pytest.approx(0.3)


@pytest.mark.parametrize("factor", [0.125, 1.5, 2.0, 1000.0])
@pytest.mark.parametrize(
    ("formula", "worth"),
    TABLES["a factor on both sides multiplies robustness and changes nothing else"],
)
def test_a_factor_on_both_sides_multiplies_robustness_and_changes_nothing_else(
    formula: str, worth: float, factor: float
) -> None:
    table = table_of({**COLUMNS, "rate": [1.0, 2.0, 2.0, 2.0]})
    one, other = (judge_table(formula.format(by), table, Reading()) for by in (1.0, factor))
    assert one.judgement.margin == pytest.approx(worth)
    assert one.verdict is other.verdict
    assert other.judgement.time_s == one.judgement.time_s
    assert other.judgement.margin == pytest.approx(factor * worth)
    for bound in ("robustness_low", "robustness_high"):
        assert getattr(other, bound) == pytest.approx(factor * getattr(one, bound))


def test_verdict() -> None:
    for formula, verdict in (
        ("always(gap > 2)", Verdict.PASS),
        ("always(brake implies previous(gap) > 1)", None),
        ("always(brake implies once[0 s, 0.1 s](gap > 4.5))", Verdict.FAIL),
        ("always(brake implies eventually[0 s, 0.2 s](gap > 5))", Verdict.INCONCLUSIVE),
        ("always(gap > 99 implies brake)", Verdict.VACUOUS),
        ("eventually(mode == degraded)", Verdict.PASS),
        ("always(1 / (gap - 4) < 9)", Verdict.ERROR),
    ):
        if verdict is None:
            refused(InputError, judged, formula, says="condition")
        else:
            assert judged(formula).verdict is verdict


def test_an_error_names_the_cell_or_the_calculation() -> None:
    item = judged("always(1 / (gap - 4) < 9)").judgement
    assert item.detail is not None
    assert "division by 0" in item.detail
    table = table_of({**COLUMNS, "gap": [9.0, None, 3.0, 4.0]})
    found = judge_table("always(gap > 0)", table, Reading())
    assert (found.verdict, found.judgement.detail) == (Verdict.ERROR, "row 2: gap is empty")
    assert np.isnan(found.robustness_low).all()


def test_parameters_stand_for_their_values_in_formula_and_window() -> None:
    formula = "always(brake implies once[0 s, tau](gap > limit))"
    given = {"tau": "100 ms", "limit": "4.5 m"}
    found = judged(formula, units={"gap": "m"}, parameters=given)
    assert found.verdict is Verdict.FAIL
    assert found.parameters == {"limit": 4.5, "tau": 0.1}
    given["tau"] = "0.2 s"
    again = judged(formula, units={"gap": "m"}, parameters=given)
    assert again.verdict is Verdict.PASS


def test_the_horizon_ends_obligations_and_beyond_the_table_leaves_them_open() -> None:
    assert judged("always(gap > 4)", horizon="0.1 s").verdict is Verdict.PASS
    assert judged("always(gap > 2)", horizon="1 h").verdict is Verdict.INCONCLUSIVE
    assert judged("always(gap > 4)", horizon="1 h").verdict is Verdict.FAIL


def test_what_does_not_fit_is_refused() -> None:
    for formula, reading, message in TABLES["what does not fit is refused"]:
        refused(InputError, judged, formula, **reading, says=message)


def test_words_that_do_not_occur_can_be_declared() -> None:
    found = judged("always(mode != lost)", words={"mode": ["ok", "degraded", "lost"]})
    assert found.verdict is Verdict.PASS


# --- times are decimals


ROWS = 12


def _on(times: Any, formula: str, bad: int, **reading: Any) -> Verdict:
    values = np.ones(len(times))
    values[bad] = -1.0
    return judge_table(formula, table_of({"time": times, "x": values}), Reading(**reading)).verdict


@pytest.mark.slow
@pytest.mark.parametrize("first", range(1, 1001, 100))
def test_a_row_at_the_end_of_a_window_belongs_to_it_at_every_step(first: int) -> None:
    for step in range(first, first + 100):
        times = [round(step * row / 1000, 3) for row in range(ROWS)]
        row = 1 + step % (ROWS - 2)
        at = f"{times[row]} s"
        assert _on(times, f"always[0 s, {at}](x > 0)", row, horizon="0 s") is Verdict.FAIL
        assert _on(times, f"eventually[{at}, {at}](x < 0)", row, horizon="0 s") is Verdict.PASS
        assert _on(times, "always(x > 0)", row, horizon=at) is Verdict.FAIL


@pytest.mark.slow
@pytest.mark.parametrize("milliseconds", [1, 3, 9, 13, 30, 50, 70, 83, 100, 333, 400, 1000])
def test_a_run_and_its_table_have_one_verdict(milliseconds: int) -> None:
    step = milliseconds / 1000
    times = tick_times(np.arange(40), step)
    clock = Series(times[np.newaxis], 1.0, "s", "number", slack=TIME_SLACK)
    for row in range(1, 40, 4):
        at, half = f"{times[row]} s", f"{times[row // 2]} s"
        for text in (
            f"always(time <= {at} or time >= {times[row] + step:.6g} s)",
            f"always(not (time > {half} and time - {half} < {step:.6g} s))",
            f"eventually(time - {half} == {times[row - row // 2]} s)",
            f"eventually(time == {at})",
            f"always(time != {at})",
            f"eventually[{at}, {at}](time == {at})",
        ):
            run = evaluate_columns(
                parse_formula(text),
                _Clock(clock),
                step_s=step,
                length=np.array([40]),
                horizon=np.array([39]),
                complete=np.array([True]),
                chosen=np.array([True]),
            )
            expected = VIOLATED if "!=" in text else SATISFIED
            assert run.verdict[0] == expected, (text, step)
            table = judge_table(text, table_of({"time": times}), Reading())
            assert table.verdict is (Verdict.PASS if expected == SATISFIED else Verdict.FAIL)


class _Clock:
    def __init__(self, clock: Series) -> None:
        self.clock = clock

    def series(self, _name: str) -> Series:
        return self.clock


@pytest.mark.parametrize("rate", [30, 60, 12])
def test_a_row_whose_rounded_time_ends_a_window_belongs_to_it(rate: int) -> None:
    times = [round(row / rate, 3) for row in range(40)]
    for row in range(1, 39):
        window = f"always[0 s, {times[row]} s](x > 0)"
        assert _on(times, window, row, horizon="0 s") is Verdict.FAIL
        assert _on(times, window, row + 1, horizon="0 s") is Verdict.PASS


def test_times_of_a_calendar_compare_as_decimals() -> None:
    times = 1_700_000_000 + np.arange(10) / 10
    formula = "eventually(time - 1700000000 s == 0.3 s)"
    assert judge_table(formula, table_of({"time": times}), Reading()).verdict is Verdict.PASS


def test_units_of_stamps_are_their_own() -> None:
    stamps = np.arange(4).astype("timedelta64[ms]")
    with pytest.raises(InputError, match="times with a unit of their own"):
        judge_table(
            "always(x > 0)",
            table_of({"time": stamps, "x": [1.0] * 4}),
            Reading(units={"time": "ms"}),
        )
    dates = np.datetime64("2024-01-01") + np.arange(4).astype("timedelta64[s]")
    columns = {"time": np.arange(4.0), "sent": dates}
    with pytest.raises(InputError, match="'sent' has dates"):
        judge_table("always(sent > 0 s)", table_of(columns), Reading())
    columns = {"time": dates, "age": np.full(4, 100).astype("timedelta64[ms]")}
    assert judge_table("always(age <= 0.1 s)", table_of(columns), Reading()).verdict is Verdict.PASS


# --- what a table tells of itself


def verdict(table: Table, formula: str, **reading: Any) -> Verdict:
    return judge_table(formula, table, Reading(**reading)).verdict


FAR = "historically[0.2 s, 0.3 s]"
NOT_FAR = "not once[0.2 s, 0.3 s]"


@pytest.mark.parametrize(
    ("formula", "found"),
    [
        # Only before 0.2 s, where nothing lies in the window.
        (f"always({FAR}(never) implies yes)", "VACUOUS"),
        (f"always({NOT_FAR}(yes) implies yes)", "VACUOUS"),
        (f"always(not not {FAR}(never) implies yes)", "VACUOUS"),
        (f"always((yes and {FAR}(never)) implies yes)", "VACUOUS"),
        (f"always((yes implies {FAR}(never)) implies yes)", "VACUOUS"),
        (f"always(historically[0.1 s, 0.1 s]({FAR}(never)) implies yes)", "VACUOUS"),
        (f"always(yes implies {FAR}(never) implies yes)", "VACUOUS"),
        ("always(historically[0.9 s, 1 s](never) implies yes)", "VACUOUS"),
        ("always(not previous(yes) implies yes)", "VACUOUS"),
        # Below the top level, where nothing else is asked for.
        (f"always(yes implies ({FAR}(never) implies yes) and yes)", "VACUOUS"),
        # At what was there.
        (f"always({FAR}(yes) implies yes)", "PASS"),
        (f"always({NOT_FAR}(never) implies yes)", "PASS"),
        ("always(historically[0 s, 1 s](yes) implies yes)", "PASS"),
        ("always(not previous(never) implies yes)", "PASS"),
        ("always(once[0.2 s, 0.3 s](yes) implies yes)", "PASS"),
        # What is asked for is as before.
        (f"always(yes implies {FAR}(yes))", "PASS"),
        (f"always({FAR}(never) implies never)", "FAIL"),
    ],
)
def test_antecedent_that_an_empty_window_meets_was_not_tested(formula: str, found: str) -> None:
    table = table_of({"time": EVEN, "yes": [True] * 4, "never": [False] * 4})
    assert verdict(table, formula).value == found


def test_heading_tells_unit_and_words_and_options_go_before_it(write: Any) -> None:
    rows = "0,1500,ok,false\n1,1700,ok,\n"
    table = read_table(write(f"t [s],gap [mm],mode [ok|lost],on [false|true]\n{rows}"))
    assert list(table.columns) == ["t", "gap", "mode", "on"]
    assert verdict(table, "always(gap > 1.2 m)") is Verdict.PASS
    assert verdict(table, "always(gap > 1.2 m)", units={"gap": "m"}) is Verdict.PASS
    assert verdict(table, "always(gap > 1.2 km)", units={"gap": "m"}) is Verdict.PASS
    # A word that does not occur is known, and so is a truth value.
    assert verdict(table, "always(not (mode == lost))") is Verdict.PASS
    assert verdict(table, "always(mode == ok or on)") is Verdict.ERROR
    assert list(read_table(write("t,row [odd]\n0,1\n")).columns) == ["t", "row [odd]"]


STATUS: dict[str, Any] = {
    "time": EVEN,
    "ttc": [3.0, None, None, 2.0],
    "ttc.status": ["value", "no_conflict", "no_conflict", "value"],
    "on": [True, True, True, None],
    "on.status": ["value"] * 3 + ["not_applicable"],
}


def test_sample_that_is_none_says_why() -> None:
    assert verdict(table_of(STATUS), "always(ttc > 1)") is Verdict.PASS
    assert verdict(table_of(STATUS), "always(ttc > 2.5)") is Verdict.FAIL
    assert verdict(table_of(STATUS), "always(on)") is Verdict.INCONCLUSIVE
    assert verdict(table_of(STATUS), "always(on)", horizon="0.2 s") is Verdict.PASS
    wrong = {**STATUS, "ttc.status": ["value", "error", "no_conflict", "value"]}
    found = judge_table("always(ttc > 1)", table_of(wrong), Reading())
    assert (found.verdict, found.judgement.detail) == (Verdict.ERROR, "row 2: ttc is empty")


@pytest.mark.parametrize(
    ("ages", "words", "margin"),
    [
        ([50.0, 7.0, 9.0, 30.0], ["value"] * 4, 5.0),
        ([50.0, None, 9.0, 30.0], ["value", "no_conflict", "value", "value"], 7.0),
        ([50.0, None, None, 60.0], ["value", "no_conflict", "no_conflict", "value"], 48.0),
    ],
)
def test_margin_of_a_column_is_that_of_its_numbers(
    ages: list[float | None], words: list[str], margin: float
) -> None:
    table = table_of({"time": EVEN, "age": ages, "age.status": words})
    found = judge_table("always(age >= 2)", table, Reading())
    assert found.judgement.margin == margin


def test_empty_cell_stays_an_error_where_nothing_says_why() -> None:
    table = table_of({**STATUS, "ttc.status": ["value"] * 4})
    assert verdict(table, "always(ttc > 1)") is Verdict.ERROR


@pytest.mark.parametrize("word", ["gone", "", "ERROR", None, 1])
def test_word_that_says_nothing_of_a_sample_is_refused(word: Any) -> None:
    # All of the column as values, the error among them, would be a PASS.
    given = {**STATUS, "ttc": [3.0] * 4, "ttc.status": ["value", "error", word, "value"]}
    error = refused(InputError, verdict, table_of(given), "always(ttc > 1)")
    assert "row 3" in str(error)
    assert "Write value, no_conflict, not_applicable, error, or give" in str(error)
    assert verdict(table_of(given), "always(on or time >= 0 s)") is Verdict.PASS


def test_archive_is_read_with_what_it_tells(tmp_path: Path) -> None:
    told = {"schema": TRACE_TABLE, "units": {"gap": "km"}, "horizon": "0.1 s", "words": 5}
    arrays: dict[str, Any] = {"time": np.array(EVEN), "gap": np.array([3.0, 3.0, 1.0, 1.0])}
    path = tmp_path / "run.npz"
    np.savez(path, **arrays, about=np.array(json.dumps(told)))
    assert verdict(read_table(path), "always(gap > 2 km)") is Verdict.PASS
    assert verdict(read_table(path), "always(gap > 2 km)", horizon="0.3 s") is Verdict.FAIL
    np.savez(path, **arrays, about=np.array("no JSON"))
    refused(InputError, read_table, path, says="unequal lengths")


def test_archive_that_is_packed_or_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    np.savez_compressed(path, time=np.zeros(10_000))
    refused(InputError, read_table, path, says="is packed")
    path.write_bytes(b"PK")
    refused(InputError, read_table, path, says="no archive of arrays")
    np.savez(path, time=np.array([None, 1.0], dtype=object))
    refused(InputError, read_table, path, says="no archive of arrays")
