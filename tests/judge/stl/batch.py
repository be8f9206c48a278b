"""Series made by hand, and what a formula says about runs of them."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from adeye.judge.stl.batch import SATISFIED, VIOLATED, StlColumns, evaluate_columns
from adeye.judge.stl.descent import BINDING_STATUSES
from adeye.judge.stl.formula import parse_formula
from adeye.judge.stl.series import Series


class Signals(dict[str, Series]):
    """Series by name."""

    def series(self, name: str) -> Series:
        return self[name]


def numbers(values: Any, **options: Any) -> Series:
    rows = np.atleast_2d(np.asarray(values, dtype=float))
    return Series(rows, options.pop("scale", 1.0), options.pop("unit", "1"), "number", **options)


def truths(values: Any, **options: Any) -> Series:
    return Series(np.atleast_2d(np.asarray(values)), 1.0, "1", "boolean", **options)


def words(values: Any, *labels: str, **options: Any) -> Series:
    return Series(np.atleast_2d(np.asarray(values)), 1.0, "1", "enumeration", labels, **options)


def judge(  # noqa: PLR0913 - what a formula is evaluated on
    text: str,
    signals: dict[str, Series],
    *,
    step_s: float = 1.0,
    length: list[int] | None = None,
    horizon: list[int] | None = None,
    complete: bool = True,
    chosen: list[bool] | None = None,
) -> StlColumns:
    runs, rows = next(iter(signals.values())).values.shape
    lengths = np.array(length or [rows] * runs)
    return evaluate_columns(
        parse_formula(text),
        Signals(signals),
        step_s=step_s,
        length=lengths,
        horizon=np.array(horizon) if horizon else lengths - 1,
        complete=np.full(runs, complete),
        chosen=np.ones(runs, bool) if chosen is None else np.array(chosen),
    )


def standing(result: StlColumns, run: int = 0) -> str:
    """Say what a formula is on a run."""
    if result.error[run]:
        return "error"
    if result.verdict[run] == SATISFIED:
        return "vacuous" if result.vacuous[run] else "satisfied"
    return "violated" if result.verdict[run] == VIOLATED else "undecided"


@dataclass(frozen=True)
class Bound:
    """A binding predicate as people see it."""

    text: str
    signal: str
    row: int | None
    obligation: int
    actor: int | None
    value: float | str | None
    threshold: float | str | None
    difference: float | None
    unit: str
    status: str


def binding(result: StlColumns, run: int = 0) -> Bound:
    assert not result.error[run]
    seen = result.program.words[result.node[run]]
    status = BINDING_STATUSES[result.status[run]]
    value, threshold, difference = (
        None if np.isnan(column[run]) else float(column[run])
        for column in (result.value, result.threshold, result.difference)
    )

    def shown(number: float | None) -> float | str | None:
        return seen.values[int(number)] if number is not None and seen.values else number

    return Bound(
        text=seen.text,
        signal=seen.signal,
        row=None if result.row[run] < 0 else int(result.row[run]),
        obligation=int(result.obligation[run]),
        actor=None if result.actor[run] < 0 else int(result.actor[run]),
        value=shown(value),
        threshold=shown(threshold),
        difference=difference,
        unit=seen.empty_unit if status == "not_applicable" else seen.unit,
        status=status,
    )


def at_samples(text: str, **inputs: Series) -> StlColumns:
    """Judge every sample of some series as a run of its own."""

    def turned(part: Any) -> Any:
        return None if part is None else part.reshape(-1, 1)

    alone = {
        name: Series(
            turned(series.values),
            series.scale,
            series.unit,
            series.kind,
            series.labels,
            turned(series.status),
            series.cap,
            turned(series.actor),
        )
        for name, series in inputs.items()
    }
    return judge(text, alone)


def errors_of(series: Series) -> np.ndarray:
    """Tell which samples (B, T) of a series a formula that reads them takes as errors."""
    texts = {"number": "x > 0", "boolean": "x"}
    text = texts.get(series.kind) or f"x == {series.labels[0]}"
    return at_samples(text, x=series).error.reshape(series.values.shape)
