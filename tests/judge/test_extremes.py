"""A formula of one comparison is worth on few samples what it is worth on the whole run."""

from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from adeye.judge.extremes import evaluate_extremes, find_extremes, measure_of
from adeye.judge.stl.batch import StlColumns, evaluate_columns, joined_columns
from adeye.judge.stl.formula import parse_formula
from adeye.judge.stl.series import Series
from adeye.signals import Bools, SignalType
from tests.stored import known

DICTIONARY = {"gap": SignalType("m", 3.0, "number", "", (), 10.0)}
RUNS = 64


class Source:
    def __init__(self, series: Series) -> None:
        self.samples = series

    def series(self, _name: str) -> Series:
        return self.samples


def test_one_comparison_depends_on_one_extreme() -> None:
    for text, measure in (
        ("always(gap > 2 m)", "least gap"),
        ("always(gap <= 2 m)", "greatest gap"),
        ("always(2 m < gap)", "least gap"),
        ("eventually(abs(gap) < 2 m)", "least abs(gap)"),
        ("eventually(gap >= 2 m)", "greatest gap"),
    ):
        found = measure_of(parse_formula(text))
        assert found is not None, text
        assert found.text == measure, text


def test_other_formulas_need_the_trace() -> None:
    for text in (
        "always[0 s, 2 s](gap > 2 m)",
        "always(gap > 2 m and gap < 9 m)",
        "gap > 2 m",
        "always(gap == 2 m)",
        "always(gap + 1 m > 2 m)",
        "not always(gap > 2 m)",
    ):
        assert measure_of(parse_formula(text)) is None


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(30))
def test_samples_give_what_the_run_gives_for_every_threshold(seed: int) -> None:
    noise = np.random.default_rng(seed)
    rows = int(noise.integers(2, 14))
    shape = (RUNS, rows)
    values = (
        noise.normal(0.0, 3.0, shape),
        noise.integers(-3, 4, shape).astype(np.float64),
        1.0 + noise.integers(0, 5, shape) * 2.0**-52,
        noise.normal(0.0, 40.0, shape),
    )[seed % 4]
    status = noise.choice(4, p=[0.79, 0.1, 0.1, 0.01], size=shape).astype(np.int8)
    if seed % 3 == 0:
        status[:] = 0
    values = np.where(status == 0, values, np.where(status == 1, np.inf, 0.0))
    actor = noise.integers(-1, 3, shape)
    series = Series(values, 3.0, "m", "number", status=status, cap=10.0, actor=actor)
    asked: dict[str, Any] = {
        "length": noise.integers(1, rows + 1, RUNS),
        "horizon": noise.integers(0, rows + 3, RUNS),
        "complete": noise.random(RUNS) < 0.5,
        "chosen": np.ones(RUNS, dtype=np.bool_),
    }
    uncertain = total = 0
    for operator in ("always", "eventually"):
        for relation in ("<", "<=", ">", ">="):
            for term in ("gap", "abs(gap)"):
                for limit in (0.0, 1.0, 1.0 + 2.0**-52, 2.5, 100.0):
                    formula = parse_formula(f"{operator}({term} {relation} {limit!r} m)")
                    measure = known(measure_of(formula))
                    whole = evaluate_columns(formula, Source(series), step_s=0.1, **asked)
                    kept = find_extremes(measure, series, **asked)
                    found = evaluate_extremes(formula, kept, DICTIONARY, 0.1)
                    total += RUNS
                    uncertain += int((~found.is_certain).sum())
                    _check(whole, found.columns, found.is_certain)
    assert uncertain <= 0.1 * total


def _check(whole: StlColumns, found: StlColumns, certain: Bools) -> None:
    assert (whole.error == found.error)[certain].all()
    compared = certain & ~whole.error
    for item in fields(StlColumns):
        if item.name not in {"program", "obligation", "error"}:
            one, other = getattr(whole, item.name), getattr(found, item.name)
            np.testing.assert_array_equal(one[compared], other[compared], err_msg=item.name)


def test_parts_are_joined() -> None:
    measure = known(measure_of(parse_formula("always(gap > 2 m)")))
    series = Series(np.array([[3.0, 1.0, 2.0]]), 3.0, "m", "number")
    ends = np.array([3])
    kept = find_extremes(
        measure,
        series,
        length=ends,
        horizon=ends,
        complete=np.array([True]),
        chosen=np.array([True]),
    )
    whole = joined_columns([kept, kept])
    assert whole.row.tolist() == [[0, 0, 1, -1, -1]] * 2
    assert whole.value[:, 2].tolist() == [1.0, 1.0]
