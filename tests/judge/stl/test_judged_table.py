"""A formula on a table: verdict, place and robustness; what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.errors import InputError
from adeye.judge.stl.batch import SATISFIED, VIOLATED, evaluate_columns
from adeye.judge.stl.formula import parse_formula
from adeye.judge.stl.series import Series
from adeye.judge.stl.table import JudgedTable, Reading, judge_table, table_of
from adeye.judge.verdict import Verdict
from adeye.kernel.relation import TIME_SLACK, tick_times

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


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.125, 1.5, 2.0, 1000.0])
@pytest.mark.parametrize(
    ("formula", "worth"),
    [
        ("always({0} * gap >= {0} * 2)", 1.0),
        ("always({0} * (gap - 1.5 * rate) >= {0} * 2)", -2.0),
        ("eventually({0} * gap < rate * {0} + {0})", 0.0),
        ("always(brake implies gap / (1 / {0}) >= {0} * 2.5)", 0.5),
    ],
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


@pytest.mark.parametrize(
    ("formula", "verdict"),
    [
        ("always(gap > 2)", Verdict.PASS),
        ("always(brake implies previous(gap) > 1)", None),
        ("always(brake implies once[0 s, 0.1 s](gap > 4.5))", Verdict.FAIL),
        ("always(brake implies eventually[0 s, 0.2 s](gap > 5))", Verdict.INCONCLUSIVE),
        ("always(gap > 99 implies brake)", Verdict.VACUOUS),
        ("eventually(mode == degraded)", Verdict.PASS),
        ("always(1 / (gap - 4) < 9)", Verdict.ERROR),
    ],
)
def test_verdict(formula: str, verdict: Verdict | None) -> None:
    if verdict is None:
        with pytest.raises(InputError, match="condition"):
            judged(formula)
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


@pytest.mark.parametrize(
    ("formula", "reading", "message"),
    [
        ("always(gp > 4)", {}, "no column 'gp', which the formula names"),
        ("always(gap > 4 m)", {}, "'gap' is a plain number, '4 m' is a length"),
        ("always(gap > tau)", {}, "no column 'tau'"),
        ("always(gap > 4)", {"parameters": {"tau": "1 s"}}, "does not name parameter 'tau'"),
        ("always(gap > 4)", {"parameters": {"gap": "1 s"}}, "parameter 'gap' is a column, too"),
        ("always(gap > 4)", {"parameters": {"once": "1 s"}}, "is a word of the language, too"),
        ("always(gap > tau)", {"parameters": {"tau": "1 s"}}, "'tau' is a time"),
        ("always[0 s, tau](gap > 1)", {"parameters": {"tau": "1 m"}}, "'tau' is not a time"),
        ("always(gap > tau)", {"parameters": {"tau": "one"}}, "'one' is not a quantity"),
        ("always(gap > 4)", {"horizon": "-1 s"}, "the horizon '-1 s' is below 0"),
        ("always(gap > 4)", {"horizon": "1 m"}, "is not a time"),
        ("once(gap > 4)", {}, "would look back from the first row only"),
        ("always(mode == lost)", {}, "'lost' is not a value of 'mode'"),
        ("always[0.01 s, 0.02 s](gap > 4)", {}, "contains no row"),
    ],
)
def test_what_does_not_fit_is_refused(formula: str, reading: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as caught:
        judged(formula, **reading)
    assert message in str(caught.value)


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
