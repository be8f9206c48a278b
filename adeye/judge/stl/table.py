"""A table with a column of times as the source of a formula's signals.

A cell is a number, a truth value or a word; an empty one is no value. Nothing is filled in: a
formula that reads an empty cell is in error, and rows that are not evenly spaced are refused.

A column may say of itself what it is, ``gap [m]`` or ``mode [ok|lost]``, and a column
``gap.status`` of each sample of ``gap`` why it is no value, by the words of ``SampleStatus``: so
does the table that ``adeye trace`` writes.
"""

from __future__ import annotations

import csv
import json
import math
import re
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, NoReturn

import numpy as np

from adeye.errors import InputError, MissingExtra, SourceLocation, require_known
from adeye.judge.evaluate import Frame
from adeye.judge.series import SERIES
from adeye.judge.stl.batch import HELD, NEEDED, evaluate_columns, evaluate_rows
from adeye.judge.stl.formula import TRUTH_LABELS, parse_formula
from adeye.judge.stl.parser import KEYWORDS, cut
from adeye.judge.stl.series import SampleStatus, Series
from adeye.judge.stl.syntax import ROW_SLACK, last_row, nested_implications
from adeye.judge.verdict import Verdict
from adeye.kernel.relation import TIME_SLACK, tick_time
from adeye.outputs import require_plain
from adeye.units import (
    FEWER_DIGITS,
    ROUNDED,
    UNITS,
    Dimension,
    convert,
    decimal,
    is_rounded,
    parse_quantity,
    read_quantity,
    shown,
    si_unit,
)

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from adeye.judge.stl.formula import Formula
    from adeye.judge.stl.parser import Parameters
    from adeye.judge.verdict import Judgement
    from adeye.signals import Floats

# --- A table with a column of times as the source of a formula's signals --------------------------

TIMES: Final = ("time", "time_s", "t")
"""Columns that are taken for the time if none is named."""
TOLERANCE: Final = 0.1
"""Part of a step by which a row may be off its place: stamps are rounded, samples jitter."""
MAX_BYTES: Final = 256 * 2**20
"""Largest CSV file that is read [bytes]; our choice: cells are kept as text."""
_SHORTEST_S, _LONGEST_S = 1e-9, 1e6
"""Between two rows: anything else is a time in another unit [s]."""
_MOST_BITS: Final = 1023
"""Of whole numbers: more do not fit into a float."""
_DELIMITERS: Final = (",", ";", "\t")

ABOUT: Final = "about"
"""Array of a NumPy archive, and key of a Parquet file, with what is told of a table, as JSON."""
TRACE_TABLE: Final = "adeye/trace-table@2"
"""What a table of a run's signals says that it is."""
STATUS: Final = ".status"
"""What the name of a column ends in that says why samples of another one are no values."""
STATUSES: Final = {item.name.lower(): item for item in SampleStatus}
_HEADING: Final = re.compile(r"(.*\S)\s*\[([^\[\]]+)\]")
_WORDS_APART: Final = "|"


@dataclass(frozen=True)
class Table:
    """Columns of equal length.

    Attributes:
        name: Where it comes from, for messages.
        columns: Cells by column: text, numbers, truth values, None.
        lines: Line of each row in its file; empty if it comes from no text file.
        durations: Columns that brought a unit of their own; their cells are seconds.
        dates: Those of them that were dates: seconds after their first row.
        units: Units that the table tells of its columns.
        words: Words that it tells that a column may have.
        horizon: Time until which obligations begin, as it tells; None: it does not.
    """

    name: str
    columns: Mapping[str, Sequence[Any]]
    lines: Sequence[int] = ()
    durations: frozenset[str] = frozenset()
    dates: frozenset[str] = frozenset()
    units: Mapping[str, str] = field(default_factory=dict)
    words: Mapping[str, Sequence[str]] = field(default_factory=dict)
    horizon: str | None = None

    @property
    def rows(self) -> int:
        """How many rows it has."""
        return len(next(iter(self.columns.values()), ()))

    def cells(self, name: str) -> Sequence[Any]:
        """Give a column.

        Raises:
            InputError: There is none of that name.
        """
        said = f"{self.name} has no column {shown(name)}"
        require_known([name], self.columns, lambda _: said, InputError)
        return self.columns[name]

    def place(self, row: int) -> str:
        """Name a row for people: its line in the file, or its number."""
        return f"line {self.lines[row]}" if self.lines else f"row {row + 1}"

    def refuse(self, message: str, remedy: str, row: int, column: str = "") -> NoReturn:
        """Raise an error about a row."""
        if self.lines:
            number = list(self.columns).index(column) + 1 if column else 1
            where = SourceLocation(self.name, self.lines[row], number)
            raise InputError(message, where=where, remedy=remedy)
        raise InputError(f"{self.name}, row {row + 1}: {message}", remedy=remedy)

    def refuse_rounded(self, column: str, numbers: Sequence[float | None]) -> None:
        """Raise an error about the first cell of a column that is not the number read of it."""
        for row, (cell, number) in enumerate(zip(self.cells(column), numbers, strict=True)):
            if number is not None and _is_rounded(cell, number):
                named = "" if self.lines else f" in column {shown(column)}"
                self.refuse(f"{_text(cell)[:40]}{named} {ROUNDED}", FEWER_DIGITS, row, column)


# --- reading


def read_table(path: Path) -> Table:
    """Read a CSV file, separated by comma, semicolon or tab, a Parquet file or a NumPy archive.

    Raises:
        InputError: It is not there, is no table, or has rows of unequal length.
    """
    if path.suffix.lower() in {".parquet", ".pq"}:
        return _read_parquet(path)
    if path.suffix.lower() == ".npz":
        return _read_archive(path)
    try:
        require_plain(path, MAX_BYTES)
        with path.open(encoding="utf-8-sig", newline="") as file:
            header = file.readline()
            delimiter = max(_DELIMITERS, key=header.count)
            file.seek(0)
            return _rows_of(path, csv.reader(file, delimiter=delimiter, strict=True))
    except OSError as error:
        raise InputError(
            f"{shown(str(path))} cannot be read: {error.strerror}", remedy="Name a table."
        ) from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not text in UTF-8", remedy="Save it as CSV.") from error
    except csv.Error as error:
        raise InputError(f"{path} is not a CSV file: {error}", remedy="Save it again.") from error


def _rows_of(path: Path, reader: Any) -> Table:
    titles = [cell.strip() for cell in next(reader, [])]
    header, units, words = _told_by(titles)
    if not any(header):
        raise InputError(f"{path} has no line of column names", remedy="Begin it with one.")
    _require_once(header, str(path))
    cells: list[list[str]] = [[] for _ in header]
    lines: list[int] = []
    blank = 0
    for row in reader:
        if not row:
            blank = blank or reader.line_num
            continue
        if blank or len(row) != len(header):
            count, line = (0, blank) if blank else (len(row), reader.line_num)
            raise InputError(
                f"a row of {count} cells, and {len(header)} columns",
                where=SourceLocation(str(path), line, 1),
                remedy="Give each row a cell for each column.",
            )
        lines.append(reader.line_num)
        for column, cell in zip(cells, row, strict=True):
            column.append(cell.strip())
    columns = dict(zip(header, cells, strict=True))
    return Table(str(path), columns, lines, units=units, words=words)


def _told_by(titles: Sequence[str]) -> tuple[list[str], dict[str, str], dict[str, list[str]]]:
    """Take the units and words apart from names; what is neither belongs to the name.

    >>> _told_by(["gap [m]", "mode [ok|lost]", "row [odd]"])
    (['gap', 'mode', 'row [odd]'], {'gap': 'm'}, {'mode': ['ok', 'lost']})
    """
    names, units, words = [], dict[str, str](), dict[str, list[str]]()
    for title in titles:
        found = _HEADING.fullmatch(title)
        name, told = (found[1], found[2]) if found is not None else (title, "")
        if told in UNITS:
            units[name] = told
        elif _WORDS_APART in told:
            words[name] = [word.strip() for word in told.split(_WORDS_APART)]
        else:
            name = title
        names.append(name)
    return names, units, words


def title_of(name: str, unit: str, words: Sequence[str]) -> str:
    """Write the name of a column with its unit or its words.

    >>> title_of("gap", "m", ()), title_of("mode", "", ("ok", "lost")), title_of("lane", "", ())
    ('gap [m]', 'mode [ok|lost]', 'lane')
    """
    told = unit or _WORDS_APART.join(words)
    return f"{name} [{told}]" if told else name


def _read_parquet(path: Path) -> Table:
    import pandas as pd

    try:
        require_plain(path)
        # Without kinds that know nothing, whole numbers beside an empty cell would become floats.
        frame = pd.read_parquet(path, dtype_backend="numpy_nullable")
    except ImportError as error:
        raise MissingExtra.of(
            f"{path}, a Parquet file,", "columnar", otherwise="save the table as CSV"
        ) from error
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {error}", remedy="Name a table.") from error
    return table_of(frame, str(path))


def _read_archive(path: Path) -> Table:
    try:
        require_plain(path, MAX_BYTES)
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as stored:
            members = stored.zip.infolist()
            # What is packed may be larger than any memory.
            if sum(item.file_size for item in members) > path.stat().st_size:
                raise InputError(f"{path} is packed", remedy="Save it by numpy.savez.")
            return table_of({name: stored[name] for name in stored.files}, str(path))
    except (OSError, ValueError, EOFError, AttributeError, zipfile.BadZipFile) as error:
        said = f"{shown(str(path))} is no archive of arrays: {error}"
        raise InputError(said, remedy="Name a table.") from error


def _told_of(columns: Any) -> Mapping[str, Any]:
    """Give what a data frame or an archive tells of its columns, if it is the table of a run."""
    told = getattr(columns, "attrs", None)
    if told is None and ABOUT in columns:
        with suppress(ValueError):
            told = json.loads(str(np.asarray(columns[ABOUT])))
    if not isinstance(told, Mapping) or told.get("schema") != TRACE_TABLE:
        return {}
    units, words, horizon = (told.get(item) for item in ("units", "words", "horizon"))
    return {
        "units": {
            name: unit
            for name, unit in (units.items() if isinstance(units, Mapping) else ())
            if name in columns and isinstance(unit, str)
        },
        "words": {
            name: [str(label) for label in labels]
            for name, labels in (words.items() if isinstance(words, Mapping) else ())
            if name in columns and isinstance(labels, list | tuple)
        },
        "horizon": horizon if isinstance(horizon, str) else None,
    }


def _require_once(names: Sequence[str], path: str | None = None) -> None:
    repeated = next((name for at, name in enumerate(names) if name in names[:at]), None)
    if repeated is not None:
        raise InputError(
            f"column {shown(repeated)} occurs twice",
            where=None if path is None else SourceLocation(path, 1, names.index(repeated) + 1),
            remedy="Rename one of them.",
        )


def table_of(columns: Mapping[str, Any] | Any, name: str = "the table") -> Table:
    """Make a table of arrays by name, for example of a data frame.

    Raises:
        InputError: A column occurs twice, columns have unequal lengths or more than one dimension,
            or a whole number is too large for any computation.
    """
    # A series of pandas has keys, too, but they are no columns.
    if not hasattr(columns, "keys") or hasattr(columns, "dtype"):
        raise InputError(
            f"{shown(columns)} is no table", remedy="Give a file, a data frame, or columns by name."
        )
    told = _told_of(columns)
    is_beside = {ABOUT} if told and not hasattr(columns, "attrs") else set[str]()
    keys = [key for key in columns if key not in is_beside]
    _require_once([str(key) for key in keys])
    cells = {str(key): _array(columns[key]) for key in keys}
    if len({array.shape for array in cells.values()}) > 1 or any(
        a.ndim != 1 for a in cells.values()
    ):
        raise InputError(f"{name} has columns of unequal lengths", remedy="Give each as many rows.")
    kinds = {key: array.dtype.kind for key, array in cells.items()}
    table = Table(
        name,
        {key: _cells(array) for key, array in cells.items()},
        durations=frozenset(key for key, kind in kinds.items() if kind in "mM"),
        dates=frozenset(key for key, kind in kinds.items() if kind == "M"),
        **told,
    )
    for key, column in table.columns.items():
        for row, cell in enumerate(column):
            if isinstance(cell, int) and cell.bit_length() > _MOST_BITS:
                table.refuse(f"{shown(cell)} is too large", "Write it in another unit.", row, key)
    return table


def _array(column: Any) -> Any:
    """Make an array of a column; what NumPy would make one kind of stays as it is."""
    if isinstance(column, np.ma.MaskedArray):
        return column
    if hasattr(column, "astype") and not isinstance(column.dtype, np.dtype):
        # NumPy would make floats of the whole numbers of pandas where one is missing.
        column = column.astype(object)
    return np.asarray(column, dtype=object if isinstance(column, list | tuple) else None)


def _cells(array: Any) -> list[Any]:
    """List the samples of a column; None where there is none.

    What a mask hides has a value all the same, and pandas has words of its own for nothing.
    """
    if array.dtype.kind in "mM":
        # NumPy lists nanoseconds as plain numbers, which would be taken for seconds.
        unit = np.timedelta64(1, "s")
        if np.datetime_data(array.dtype)[0] in {"Y", "M", "generic"}:
            if array.dtype.kind == "m":
                raise InputError(
                    f"a column of {array.dtype} has no length in seconds",
                    remedy="Convert it to seconds, as numbers or as timedelta64[s].",
                )
            array = array.astype("datetime64[s]")
        begin = array[:1] if array.dtype.kind == "M" else unit * 0
        array = (array - begin) / unit
    hidden = np.ma.getmaskarray(array).tolist()
    is_made_of_numbers = array.dtype.kind in "biuf"
    return [
        None if is_hidden or not (is_made_of_numbers or _is_there(cell)) else cell
        for cell, is_hidden in zip(np.ma.getdata(array).tolist(), hidden, strict=True)
    ]


def _is_there(cell: Any) -> bool:
    if cell is np.ma.masked or type(cell).__name__ in {"NAType", "NaTType"}:
        return False
    # What is not a number, or not a time, is not equal to itself.
    return bool(cell == cell)  # noqa: PLR0124


# --- times


def time_column(table: Table, name: str | None = None) -> str:
    """Find the column of the times: the one that is named, or ``time``, ``time_s`` or ``t``.

    Raises:
        InputError: There is none.
    """
    if name is None:
        name = next((item for item in TIMES if item in table.columns), None)
    if name is None:
        raise InputError(
            f"{table.name} has no column {', '.join(TIMES)}",
            remedy=f"Name the column of the times: {', '.join(table.columns)}.",
        )
    table.cells(name)
    return name


def sampling(table: Table, name: str, unit: str = "s") -> tuple[Floats, float, float]:
    """Read the times of the rows, which must be evenly spaced.

    Args:
        table: The table.
        name: Column of the times.
        unit: Its unit.

    Returns:
        The times (T,) [s]; the step [s], see ``_step_of``; and the part of a step by which a
        difference of two times may miss a whole number of steps, which is rounding for exact times.

    Raises:
        InputError: A time is no number, does not come after the one before, or is off its place by
            more than ``TOLERANCE`` of a step; or there are fewer than 2 rows.
    """
    if unit not in UNITS or UNITS[unit].exponents != UNITS["s"].exponents:
        raise InputError(
            f"{shown(unit)} is not a unit of time", remedy="Write s, ms, min or h for the time."
        )
    _refuse_unit(table, name, unit)
    cells = [_number(cell) for cell in table.cells(name)]
    if len(cells) < 2:
        raise InputError(f"{table.name} has fewer than 2 rows", remedy="Give it at least 2.")
    for row, cell in enumerate(cells):
        if cell is None or not math.isfinite(cell):
            text = shown(table.columns[name][row])
            table.refuse(f"{text} is not a time", "Write a number.", row, name)
    table.refuse_rounded(name, cells)
    times = np.array([convert(cell, UNITS[unit]) for cell in cells if cell is not None])
    steps = np.diff(times)
    for row in np.flatnonzero(~(steps > 0.0))[:1]:
        table.refuse(
            f"time {times[row + 1]:.15g} s does not come after {times[row]:.15g} s",
            "Sort the rows, and keep one of each time.",
            int(row) + 1,
            name,
        )
    usual = float(np.median(steps))
    if not _SHORTEST_S <= usual <= _LONGEST_S:
        table.refuse(
            f"rows are {usual:.6g} s apart, not {_SHORTEST_S:g} s to {_LONGEST_S:g} s",
            "Say which unit the times have.",
            1,
            name,
        )
    for row in np.flatnonzero(np.abs(steps - usual) > TOLERANCE * usual + TIME_SLACK)[:1]:
        table.refuse(
            f"{steps[row]:.6g} s after the row before, where {usual:.6g} s are usual",
            "Sample the signals evenly; adeye invents no samples.",
            int(row) + 1,
            name,
        )
    step = _step_of(times)
    for row in np.flatnonzero(_misplaced(times, step))[:1]:
        table.refuse(
            f"time {times[row]:.15g} s is off an even spacing of {step:.6g} s",
            "Sample the signals evenly; adeye invents no samples.",
            int(row),
            name,
        )
    return times, step, _spread(times, step) / step + ROW_SLACK


def _most(values: NDArray[Any]) -> float:
    """Return the largest magnitude of numbers, 1 where there is none above 0."""
    sizes = np.abs(np.asarray(values, dtype=np.float64))
    return float(sizes[np.isfinite(sizes)].max(initial=0.0)) or 1.0


def _refuse_unit(table: Table, name: str, unit: str) -> None:
    if name in table.durations and unit != "s":
        raise InputError(
            f"column {shown(name)} has times with a unit of their own, and was said to be in "
            f"{shown(unit)}",
            remedy="Give it no unit.",
        )


def _misplaced(times: Floats, step: float) -> Any:
    places = times[0] + step * np.arange(len(times))
    return np.abs(times - places) > TOLERANCE * step + TIME_SLACK


def _spread(times: Floats, step: float) -> float:
    """Give how far the difference of two times is off a whole number of steps at most [s]."""
    return float(np.ptp(times - times[0] - step * np.arange(len(times))))


def _step_of(times: Floats) -> float:
    """Find the step that times were made with, which may be rounded or jitter.

    It is the one nearest to their mean step that they fit as well as that: a decimal of two digits,
    a whole number of rows a second or of seconds a row, else the shortest decimal.
    """
    mean = float(times[-1] - times[0]) / (len(times) - 1)
    allowed = 2.0 * _spread(times, mean) + 4.0 * float(np.spacing(np.abs(times).max()))

    def fits(step: float) -> bool:
        return step > 0.0 and _spread(times, step) <= allowed and not _misplaced(times, step).any()

    whole = float(round(mean)) if mean >= 1.0 else 1.0 / round(1.0 / mean)
    usual = [step for step in (float(f"{mean:.2g}"), whole) if fits(step)]
    if usual:
        return min(usual, key=lambda step: abs(step - mean))
    decimals = (float(f"{mean:.{digits}g}") for digits in range(3, 16))
    return next((step for step in decimals if fits(step)), mean)


# --- signals


@dataclass(frozen=True)
class TableSignals:
    """The signals of a table, one run of T rows.

    Attributes:
        table: The table.
        units: Unit of a column's numbers; they become SI. None: plain numbers.
        words: Values that a column of words may have; by default those that occur.
        time: Column of the times.
    """

    table: Table
    units: Mapping[str, str] = field(default_factory=dict)
    words: Mapping[str, Sequence[str]] = field(default_factory=dict)
    time: str | None = None

    def __post_init__(self) -> None:
        for name in (*self.units, *self.words):
            self.table.cells(name)
        for name, unit in self.units.items():
            _refuse_unit(self.table, name, unit)

    def series(self, name: str) -> Series:
        """Give the samples (1, T) of a column.

        Raises:
            InputError: The column mixes numbers and words, has a word that was not declared, or a
                unit that does not exist.
            KeyError: There is no such column.
        """
        cells = self.table.columns[name]
        if name in self.table.dates and name != self.time:
            raise InputError(
                f"column {shown(name)} has dates, which are compared with nothing",
                remedy="Subtract the time of the row, or another date.",
            )
        found = self._samples(name, cells)
        status = self._status(name)
        if status is None:
            return found
        declared = SERIES.get(name.removeprefix("any_actor."))
        cap = None if declared is None else declared.type.cap
        if declared is None and (status == SampleStatus.NO_CONFLICT).any():
            # Nobody says what "no conflict" is worth: as much as the most that there is.
            cap = _most(found.values)
        return replace(found, status=status, cap=cap if found.kind == "number" else None)

    def _status(self, name: str) -> NDArray[np.int8] | None:
        """Read (1, T) what the samples of a column are, if another column says that.

        One word that is none would let every error of the column count as a value.
        """
        beside = f"{name}{STATUS}"
        cells = self.table.columns.get(beside)
        if cells is None:
            return None
        for row, cell in enumerate(cells):
            if _text(cell) not in STATUSES:
                self.table.refuse(
                    f"{shown(cell)} in column {shown(beside)}, which says what the samples of "
                    f"{shown(name)} are",
                    f"Write {', '.join(STATUSES)}, or give the column another name.",
                    row,
                    beside,
                )
        return np.array([[STATUSES[_text(cell)] for cell in cells]], dtype=np.int8)

    def _samples(self, name: str, cells: Sequence[Any]) -> Series:
        texts = [_text(cell) for cell in cells]
        if name in self.words:
            labels = tuple(self.words[name])
            if labels == TRUTH_LABELS:
                return self._coded(name, [text.lower() for text in texts], labels, "boolean")
            return self._coded(name, texts, labels, "enumeration")
        present = [text for text in texts if text]
        if present and all(text.lower() in TRUTH_LABELS for text in present):
            return self._coded(name, [text.lower() for text in texts], TRUTH_LABELS, "boolean")
        self._refuse_mixed_truth(name, texts)
        numbers = [_number(cell) for cell in cells]
        odd = [row for row, text in enumerate(texts) if text and numbers[row] is None]
        no_number = [
            row for row, number in enumerate(numbers) if number is not None and math.isnan(number)
        ]
        if odd and no_number and len(odd) + len(no_number) == len(present):
            self.table.refuse(
                f"{shown(cells[no_number[0]])} among the words of column {shown(name)}",
                "Leave the cell empty where there is no value, or declare it as a word.",
                no_number[0],
                name,
            )
        if odd and len(odd) == len(present):
            return self._coded(name, texts, tuple(sorted(set(present))), "enumeration")
        if odd:
            self.table.refuse(
                f"{shown(cells[odd[0]])} among the numbers of column {shown(name)}",
                "Leave the cell empty where there is no value, or declare the words of the column.",
                odd[0],
                name,
            )
        self.table.refuse_rounded(name, numbers)
        return self._numbers(name, numbers)

    def _refuse_mixed_truth(self, name: str, texts: Sequence[str]) -> None:
        """Refuse true and false beside other words that nobody declared: one is a slip."""
        is_truth = [text.lower() in TRUTH_LABELS for text in texts]
        row = next((at for at, text in enumerate(texts) if text and not is_truth[at]), None)
        if any(is_truth) and row is not None and _number(texts[row]) is None:
            self.table.refuse(
                f"{shown(texts[row])} among the truth values of column {shown(name)}",
                f"Write {' or '.join(TRUTH_LABELS)}, leave the cell empty where there is no value, "
                "or declare the words of the column.",
                row,
                name,
            )

    def _numbers(self, name: str, numbers: Sequence[float | None]) -> Series:
        is_time = name == self.time or name in self.table.durations
        unit = UNITS.get(self.units.get(name, "s" if is_time else ""))
        if unit is None and self.units.get(name, "1") != "1":
            raise InputError(
                f"column {shown(name)}: {shown(self.units[name])} is not a unit",
                remedy=f"It is one of {', '.join(UNITS)}.",
            )
        values = np.array([math.nan if cell is None else cell for cell in numbers])
        if unit is None:
            return Series(values[np.newaxis], 1.0, "1", "number", is_scaled=False)
        values = np.array([convert(value, unit) for value in values.tolist()])
        # Times far from 0, as those of a calendar, are rounded more.
        largest = np.abs(values[np.isfinite(values)]).max(initial=0.0)
        # The age of a sample or a command of a run is a difference of times, too.
        is_clock = is_time or name.endswith(".age")
        slack = TIME_SLACK + 4.0 * float(np.spacing(largest)) if is_clock else 0.0
        shown_unit = si_unit(unit.exponents)
        return Series(values[np.newaxis], 1.0, shown_unit, "number", slack=slack, is_scaled=False)

    def _coded(self, name: str, texts: Sequence[str], labels: tuple[str, ...], kind: Any) -> Series:
        if name in self.units:
            raise InputError(
                f"column {shown(name)} has the words {', '.join(labels)}, and no unit",
                remedy="Give units to numbers only.",
            )
        codes = np.full((1, len(texts)), math.nan)
        for row, text in enumerate(texts):
            if text and text not in labels:
                self.table.refuse(
                    f"{shown(text)} is none of the words {', '.join(labels)} of column "
                    f"{shown(name)}",
                    "Declare every word of the column.",
                    row,
                    name,
                )
            if text:
                codes[0, row] = labels.index(text)
        words = () if kind == "boolean" else labels
        return Series(codes, 1.0, "1", kind, words, is_scaled=False)

    def missing(self, names: Sequence[str]) -> str | None:
        """Say where the first sample is that is no value; None if all are."""
        found = [
            (int(row), name)
            for name in names
            for row in np.flatnonzero(_is_missing(self.series(name)))[:1]
        ]
        if not found:
            return None
        row, name = min(found)
        cell = self.table.columns[name][row]
        text = "empty" if not _text(cell) else f"{_text(cell)}, which is no finite number"
        return f"{self.table.place(row)}: {name} is {text}"


def _is_missing(series: Series) -> Any:
    """(T,) whether a sample is none though it ought to be a value."""
    is_none = ~np.isfinite(series.values[0])
    if series.status is None:
        return is_none
    status = series.status[0]
    return (is_none & (status == SampleStatus.VALUE)) | (status == SampleStatus.ERROR)


def _text(cell: Any) -> str:
    return "" if cell is None else str(cell).strip()


def _is_rounded(cell: Any, number: float) -> bool:
    if isinstance(cell, int):
        return number != cell
    return not isinstance(cell, float) and is_rounded(_text(cell), number)


def _number(cell: Any) -> float | None:
    """Read a number; None for what is none, also for nothing."""
    if isinstance(cell, bool):
        return None
    if isinstance(cell, int | float):
        return float(cell)
    text = _text(cell)
    try:
        return decimal(text)
    except ValueError:
        return None


# --- A formula on a table: the verdict, what it comes from, and the robustness at every row -------


@dataclass(frozen=True)
class Reading:
    """How a table is read.

    Attributes:
        time: Column of the times; None: ``time``, ``time_s`` or ``t``.
        units: Unit of a column's numbers, by column; of the time, seconds by default.
        words: Words that a column may have, by column; by default those that occur.
        parameters: Values of what the formula names beside columns: text with a unit, or numbers.
        horizon: Time after the first row until which obligations begin; None: as the table tells,
            else to the last row.
    """

    time: str | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    words: Mapping[str, Sequence[str]] = field(default_factory=dict)
    parameters: Mapping[str, str | float] = field(default_factory=dict)
    horizon: str | None = None


@dataclass(frozen=True)
class JudgedTable:
    """What a formula is on a table.

    Attributes:
        formula: Its text.
        judgement: Verdict, robustness and binding predicate; the time is that of the table.
        step_s: Time between rows [s].
        horizon_s: Time after the first row until which obligations begin [s].
        parameters: Values of the parameters in SI.
        time_s: (T,) times of the table [s].
        robustness_low: (T,) lower bound of the robustness of the formula at each row; NaN behind
            the horizon, and everywhere in error.
        robustness_high: (T,) upper bound.
    """

    formula: str
    judgement: Judgement
    step_s: float
    horizon_s: float
    parameters: Mapping[str, float]
    time_s: Floats
    robustness_low: Floats
    robustness_high: Floats

    def __repr__(self) -> str:
        """Name the formula and its verdict, and where the margin is."""
        item = self.judgement
        at = "" if item.time_s is None else f" at {item.time_s:.15g} s"
        margin = "" if item.margin is None else f", margin {item.margin:.6g}{at}"
        return f"<JudgedTable {cut(self.formula)}: {self.verdict.value}{margin}>"

    @property
    def verdict(self) -> Verdict:
        """PASS, FAIL, INCONCLUSIVE, VACUOUS or ERROR."""
        return self.judgement.verdict

    def __bool__(self) -> bool:
        """Be true if the formula holds, and nothing less."""
        return self.verdict is Verdict.PASS


def judge_table(text: str, table: Table, reading: Reading) -> JudgedTable:
    """Evaluate a formula on a table.

    Args:
        text: The formula; it names columns and parameters.
        table: The table, one row a sample.
        reading: How it is read.

    Raises:
        InputError: The formula, the table or what is told of it cannot be used.
    """
    column = time_column(table, reading.time)
    units = {**table.units, **reading.units}
    times, step, row_slack = sampling(table, column, units.get(column, "s"))
    signals = TableSignals(table, units, {**table.words, **reading.words}, column)
    parameters = _parameters(reading.parameters, table)
    formula = parse_formula(text, parameters=parameters)
    _check_names(formula, table, parameters)
    horizon, row = _horizon(reading.horizon or table.horizon, (step, row_slack), len(times))
    asked: dict[str, Any] = {
        "step_s": step,
        "row_slack": row_slack,
        "length": np.array([len(times)]),
        "horizon": np.array([row]),
        "complete": np.array([row < len(times)]),
    }
    result = evaluate_columns(formula, signals, **asked, chosen=np.array([True]))
    low, high = evaluate_rows(formula, signals, **asked)
    frame = Frame(step, (), np.array([False]), (None,))
    judgement = frame.judge_formula(result, text).of_run(0)
    assert judgement is not None
    judgement = _named(judgement, formula, result.nested[0].tolist())
    return JudgedTable(
        formula=text,
        judgement=_placed(judgement, signals, formula, times, step),
        step_s=step,
        horizon_s=horizon,
        parameters=dict(formula.parameters),
        time_s=times,
        robustness_low=low[0],
        robustness_high=high[0],
    )


def _parameters(given: Mapping[str, str | float], table: Table) -> Parameters:
    for name in given:
        if name in KEYWORDS or name in TRUTH_LABELS or name in table.columns:
            kind = "a column" if name in table.columns else "a word of the language"
            raise InputError(
                f"parameter {shown(name)} is {kind}, too", remedy="Give it another name."
            )
    return {name: read_quantity(str(value)) for name, value in given.items()}


def _check_names(formula: Formula, table: Table, parameters: Parameters) -> None:
    named = {name for name, _ in formula.parameters}
    for name in parameters:
        if name not in named:
            raise InputError(
                f"the formula does not name parameter {shown(name)}", remedy="Remove it or name it."
            )
    has_not = f"{table.name} has no column"
    require_known(
        formula.names,
        table.columns,
        lambda name: f"{has_not} {shown(name)}, which the formula names",
        InputError,
    )


def _horizon(text: str | None, grid: tuple[float, float], rows: int) -> tuple[float, int]:
    """Give the horizon and its row; the grid is the step and its slack."""
    if text is None:
        return tick_time(rows - 1, grid[0]), rows - 1
    horizon = parse_quantity(text, Dimension.TIME)
    if horizon < 0.0:
        raise InputError(f"the horizon {shown(text)} is below 0", remedy="Write 0 s or more.")
    return horizon, min(last_row(horizon, *grid), rows)


def _named(judgement: Judgement, formula: Formula, nested: Sequence[int]) -> Judgement:
    """Name the nested implications that this one run never asked for; they may be all there is."""
    detail = judgement.detail
    for node, (at, kind) in zip(
        nested_implications(formula.root), enumerate(nested, start=1), strict=True
    ):
        if kind != HELD and detail is not None:
            detail = detail.replace(
                f"nested implication {at} ",
                f"nested implication {at} ({formula.quote(node.left)}) ",
            )
    if NEEDED not in nested:
        return replace(judgement, detail=detail)
    return replace(
        judgement, verdict=Verdict.VACUOUS, is_exercised=False, margin=None, detail=detail
    )


def _placed(
    judgement: Judgement, signals: TableSignals, formula: Formula, times: Floats, step: float
) -> Judgement:
    """Tell times as the table does, and where a value is missing."""
    if judgement.verdict is Verdict.ERROR:
        missing = signals.missing(formula.names)
        reason = "a calculation in the formula has no finite result, such as a division by 0"
        return replace(judgement, detail=missing or reason)
    if judgement.time_s is None:
        return judgement
    return replace(judgement, time_s=float(times[round(judgement.time_s / step)]))
