"""The signals of a run as a table: a row a tick, a column for all that a formula may name.

A signal without a value at a tick, and one that says "no conflict", has an empty cell. Of a run in
left-hand traffic, signals are those of its mirror image, as formulas are told.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.errors import UsageError
from adeye.judge.stl.series import SampleStatus
from adeye.report.formats.tables import FORMATS, FileFormat, open_table, require_parquet
from adeye.store.read.export import SUFFIX_UNITS, ExportColumn, Kind
from adeye.version import __version__

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from adeye.judge.trace_signals import TraceSignals
    from adeye.signals import SignalType

SCHEMA: Final = "adeye/trace-table@1"

_SUFFIXES: Final = {unit: suffix for suffix, unit in SUFFIX_UNITS.items()}
_KINDS: Final[Mapping[str, Kind]] = {"boolean": "flag", "enumeration": "text", "number": "number"}


def form_of(path: Path) -> FileFormat:
    """Tell the form of a table by the end of its file's name, and that it can be written.

    Raises:
        UsageError: It ends in no form.
        InputError: Parquet is asked for, and pyarrow is not installed.
    """
    ending = path.suffix.lower().removeprefix(".")
    form = next((item for item in FORMATS if item == ending), None)
    if form is None:
        raise UsageError(
            f"{str(path)!r} ends in no form of a table", remedy=f"End it in .{', .'.join(FORMATS)}."
        )
    if form == "parquet":
        require_parquet()
    return form


def write_trace_table(
    signals: TraceSignals, run: int, about: Mapping[str, Any], path: Path, form: FileFormat
) -> None:
    """Write the signals of a run, always the same bytes.

    Args:
        signals: Of the batch that it is in.
        run: Its row in the batch.
        about: What a Parquet file says of the run.
        path: Of the file.
        form: Its form.

    Raises:
        InputError: Parquet is asked for, and pyarrow is not installed.
    """
    rows = int(signals.trace.length[run])
    columns = [_column(name, kind) for name, kind in signals.dictionary.items()]
    said = {"schema": SCHEMA, "tool": f"adeye {__version__}", **about}
    with open_table(path, form, columns, said) as table:
        table.add([_values(signals, name, run, rows) for name in signals.dictionary])


def _column(name: str, kind: SignalType) -> ExportColumn:
    """Name a column as tables do: ``ego.speed`` becomes ``ego_speed_mps``."""
    unit = "" if kind.unit == "1" else kind.unit
    words = [name.replace(".", "_"), *([_SUFFIXES[unit]] if unit in _SUFFIXES else [])]
    return ExportColumn("_".join(words), _KINDS[kind.kind], unit, kind.text)


def _values(signals: TraceSignals, name: str, run: int, rows: int) -> list[Any]:
    series = signals.series(name)
    values: Any = series.values[run, :rows]
    has = np.ones(rows, dtype=np.bool_)
    if series.status is not None:
        has &= series.status[run, :rows] == SampleStatus.VALUE
    if series.kind == "number":
        has &= np.isfinite(values.astype(np.float64))
    readers: Mapping[str, Callable[[Any], Any]] = {
        "number": float,
        "boolean": bool,
        "enumeration": lambda code: series.labels[int(code)],
    }
    read = readers[series.kind]
    return [read(value) if there else None for value, there in zip(values, has, strict=True)]
