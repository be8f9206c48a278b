"""The signals of a run as a table: a row a tick, a column for all that a formula may name.

A sample that is no value is an empty cell. What it is then, no conflict, not applicable or an
error, is in a column of its own, ``<signal>.status``, which stands behind all signals where any
sample of the signal is none. Of a run in left-hand traffic, signals are those of its mirror image,
as formulas are told. ``judge.stl.table`` reads what is written here.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from difflib import get_close_matches
from fnmatch import fnmatchcase
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, cast, get_args

import numpy as np

from adeye.errors import UsageError
from adeye.judge.outcome import obligation_rows
from adeye.judge.stl.formula import TRUTH_LABELS
from adeye.judge.stl.series import SampleStatus
from adeye.judge.stl.table import ABOUT, STATUS, STATUSES, TRACE_TABLE, title_of
from adeye.kernel.relation import tick_time
from adeye.report.formats.tables import FileFormat, open_table, require_parquet
from adeye.store.read.export import ExportColumn, Kind
from adeye.units import shown
from adeye.version import __version__

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    import pandas as pd

    from adeye.judge.trace_signals import TraceSignals
    from adeye.signals import SignalType

ARCHIVE: Final = "npz"
FORMS: Final = (*get_args(FileFormat), ARCHIVE)
TIME: Final = "time"

_KINDS: Final[Mapping[str, Kind]] = {"boolean": "flag", "enumeration": "text", "number": "number"}
_DTYPES: Final = {"boolean": "boolean", "enumeration": "string", "number": "float64"}


@dataclass(frozen=True, slots=True)
class SignalColumn:
    """A signal of a run, or why its samples are no values.

    Attributes:
        name: As formulas call it.
        kind: ``number``, ``boolean`` or ``enumeration``.
        unit: SI unit of numbers; empty for none.
        words: Of a truth value or an enumeration.
        text: What it means.
        values: (T,) samples: numbers, truth values or words; None for what is no value.
    """

    name: str
    kind: str
    unit: str
    words: tuple[str, ...]
    text: str
    values: tuple[Any, ...]


@dataclass(frozen=True)
class TraceTable:
    """Signals of a run.

    Attributes:
        about: What is known of the run: scenario, architecture, fault, outcome, trace.
        horizon: Time until which obligations of an FSR begin, with its unit.
        columns: The time, the signals, and what their samples are.
    """

    about: Mapping[str, Any]
    horizon: str
    columns: tuple[SignalColumn, ...]

    @cached_property
    def told(self) -> dict[str, Any]:
        """What the table tells of itself, JSON-compatible."""
        return {
            "schema": TRACE_TABLE,
            "tool": f"adeye {__version__}",
            **self.about,
            "horizon": self.horizon,
            "units": {item.name: item.unit for item in self.columns if item.unit},
            "words": {item.name: list(item.words) for item in self.columns if item.words},
        }

    @cached_property
    def titles(self) -> tuple[str, ...]:
        """Names of the columns with units and words, for forms with no other place for them."""
        return tuple(title_of(item.name, item.unit, item.words) for item in self.columns)

    @property
    def rows(self) -> Iterator[tuple[Any, ...]]:
        """Ticks, each with a sample of every column."""
        return zip(*(item.values for item in self.columns), strict=True)

    def frame(self) -> pd.DataFrame:
        """Return a data frame, with what the table tells of itself in its ``attrs``."""
        import pandas as pd

        series = {
            item.name: pd.Series(item.values, dtype=cast("Any", _DTYPES[item.kind]))
            for item in self.columns
        }
        frame = pd.DataFrame(series)
        frame.attrs.update(self.told)
        return frame


def form_of(path: Path) -> str:
    """Tell the form of a table by the end of its file's name, and that it can be written.

    Raises:
        UsageError: It ends in no form.
        MissingExtra: Parquet is asked for, and pyarrow is not installed.
    """
    form = path.suffix.lower().removeprefix(".")
    if form not in FORMS:
        raise UsageError(
            f"{str(path)!r} ends in no form of a table", remedy=f"End it in .{', .'.join(FORMS)}."
        )
    if form == "parquet":
        require_parquet()
    return form


def chosen_signals(known: Sequence[str], patterns: Sequence[str]) -> list[str]:
    """List the signals whose names fit one of the patterns, in their own order.

    Args:
        known: Names of all signals.
        patterns: Names, in which ``*``, ``?`` and ``[…]`` stand for others; none means every one.

    Raises:
        UsageError: A pattern fits none.

    >>> chosen_signals(["time", "ego.x", "ego.speed", "ttc"], ["ego.*", "ttc"])
    ['ego.x', 'ego.speed', 'ttc']
    """
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in known):
            near = get_close_matches(pattern, known, n=3)
            remedy = f"Did you mean {' or '.join(near)}?" if near else "See 'adeye signals ODD'."
            raise UsageError(f"the run has no signal {shown(pattern)}", remedy=remedy)
    return [
        name
        for name in known
        if not patterns or any(fnmatchcase(name, pattern) for pattern in patterns)
    ]


def trace_table(
    signals: TraceSignals, run: int, about: Mapping[str, Any], patterns: Sequence[str] = ()
) -> TraceTable:
    """Take signals of a run out of a batch.

    Args:
        signals: Of the batch.
        run: Its row in the batch.
        about: What is known of the run.
        patterns: Which signals, see ``chosen_signals``; the time is always one of them.

    Raises:
        UsageError: A pattern fits no signal.
    """
    names = chosen_signals(list(signals.dictionary), patterns)
    names = [TIME, *(name for name in names if name != TIME)]
    columns, beside = [], []
    for name in names:
        column, status = _columns(signals, name, run)
        columns.append(column)
        beside += [] if status is None else [status]
    return TraceTable(about, _horizon(signals, run), (*columns, *beside))


def _horizon(signals: TraceSignals, run: int) -> str:
    """Write the time until which obligations begin; beyond the last row of a run cut short."""
    trace = signals.trace
    row = int(obligation_rows(trace)[run])
    if trace.complete[run]:
        row = min(row, int(trace.length[run]) - 1)
    step = trace.layout.context.step
    return f"{tick_time(row, step):.12g} s"


def _columns(
    signals: TraceSignals, name: str, run: int
) -> tuple[SignalColumn, SignalColumn | None]:
    kind, series = signals.dictionary[name], signals.series(name)
    rows = int(signals.trace.length[run])
    values: Any = series.values[run, :rows]
    codes = np.zeros(rows, dtype=np.int64)
    if series.status is not None:
        codes = series.status[run, :rows].astype(np.int64)
    if series.kind == "number":
        # Without statuses of its own, what has no end is no conflict.
        is_odd = (codes == SampleStatus.VALUE) & ~np.isfinite(values.astype(np.float64))
        is_free = is_odd & (values == np.inf) & (series.cap is not None)
        codes = np.where(is_odd, np.where(is_free, 1, int(SampleStatus.ERROR)), codes)
    samples = tuple(
        _READ[kind.kind](kind, value) if code == SampleStatus.VALUE else None
        for value, code in zip(values.tolist(), codes.tolist(), strict=True)
    )
    unit = "" if kind.unit == "1" else kind.unit
    words = TRUTH_LABELS if kind.kind == "boolean" else kind.labels
    column = SignalColumn(name, kind.kind, unit, words, kind.text, samples)
    if not codes.any():
        return column, None
    status = tuple(_STATUS_WORDS[code] for code in codes.tolist())
    text = f"what the samples of {name} are"
    return column, SignalColumn(f"{name}{STATUS}", "enumeration", "", tuple(STATUSES), text, status)


_STATUS_WORDS: Final = {int(item): word for word, item in STATUSES.items()}


def _number(_: SignalType, value: Any) -> float:
    return float(value)


def _truth(_: SignalType, value: Any) -> bool:
    return bool(value)


def _word(kind: SignalType, value: Any) -> str:
    return kind.labels[int(value)]


_READ: Final = {"number": _number, "boolean": _truth, "enumeration": _word}


def write_trace_table(table: TraceTable, path: Path, form: str) -> None:
    """Write the signals of a run, always the same bytes.

    Args:
        table: The signals.
        path: Of the file.
        form: Its form, one of ``FORMS``.

    Raises:
        MissingExtra: Parquet is asked for, and pyarrow is not installed.
    """
    if form == ARCHIVE:
        _write_archive(table, path)
        return
    # In CSV there is no other place for units and words than the names of the columns.
    names = table.titles if form == "csv" else [item.name for item in table.columns]
    columns = [
        ExportColumn(name, _KINDS[item.kind], item.unit, item.text)
        for name, item in zip(names, table.columns, strict=True)
    ]
    with open_table(path, cast("FileFormat", form), columns, table.told) as file:
        file.add([item.values for item in table.columns])


def _write_archive(table: TraceTable, path: Path) -> None:
    """Write an array a column; numbers that are none are NaN, truth values and words empty."""
    arrays: dict[str, Any] = {
        item.name: np.array(
            [np.nan if value is None else value for value in item.values]
            if item.kind == "number"
            else item.values
            if item.kind == "boolean" and None not in item.values
            else [_cell(value) for value in item.values]
        )
        for item in table.columns
    }
    arrays[ABOUT] = np.array(json.dumps(table.told, ensure_ascii=False))
    with path.open("wb") as stream:
        np.savez(stream, **arrays)


def _cell(value: Any) -> str:
    return "" if value is None else TRUTH_LABELS[value] if isinstance(value, bool) else str(value)


def document(table: TraceTable) -> dict[str, Any]:
    """Give the signals of a run as one JSON document has them."""
    told = {name: value for name, value in table.told.items() if name not in {"schema", "words"}}
    return {**told, "signals": [asdict(item) for item in table.columns]}
