"""What the verbs print: results to standard output, talk to standard error, names made harmless."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
import os
import re
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from enum import Enum
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any, Final, TextIO, TypeVar

from typer import Exit

from adeye.fields import fields_of as fields_of
from adeye.judge.verdict import ExitCode
from adeye.outputs import laid
from adeye.report.cells import clean as clean
from adeye.report.cells import csv_cell

if TYPE_CHECKING:
    from rich.text import Text

    from adeye.judge.verdict import Verdict

# --- How a table fits a terminal: how wide its columns are, and what it is where they do not fit --

BREAKABLE: Final = 14
"""Longer words of texts may be broken; numbers and headers never are. Our choice."""
_INDENT: Final = "  "


def widths_of(
    headers: Sequence[str],
    rows: Sequence[Sequence[str]],
    right: Collection[str],
    available: int,
) -> list[int] | None:
    """Choose how wide each column is, so that no short word is broken.

    Args:
        headers: Names of the columns.
        rows: Cells as they are shown.
        right: Headers of columns of numbers.
        available: Columns of the terminal that all of them may take together.

    Returns:
        Widths, as wide as their cells if all fit; None if even the least do not fit.

    >>> widths_of(("a", "Number"), [("one two", "1")], ("Number",), 20)
    [7, 6]
    >>> widths_of(("a", "Number"), [("one two", "1")], ("Number",), 10)
    [4, 6]
    >>> widths_of(("a", "Number"), [("one two", "1")], ("Number",), 8)
    """
    columns = list(zip(*rows, strict=True)) if rows else [()] * len(headers)
    wide = [max(map(len, (header, *cells))) for header, cells in zip(headers, columns, strict=True)]
    least = [
        max(_longest_word(header), *(_least(cell, header in right) for cell in cells), 1)
        for header, cells in zip(headers, columns, strict=True)
    ]
    if sum(wide) <= available:
        return wide
    if sum(least) > available:
        return None
    room = available - sum(least)
    whole = [
        max(width, *map(_longest_word, cells), 1)
        for width, cells in zip(least, columns, strict=True)
    ]
    # First whole words, where little is missing; then lines, where much is.
    for place in sorted(range(len(least)), key=lambda place: whole[place] - least[place]):
        given = min(room, whole[place] - least[place])
        least[place] += given
        room -= given
    for _ in range(room):
        lacks = [full - width for full, width in zip(wide, least, strict=True)]
        least[lacks.index(max(lacks))] += 1
    return least


def _least(cell: str, is_number: bool) -> int:
    return len(cell) if is_number else min(BREAKABLE, _longest_word(cell))


def _longest_word(text: str) -> int:
    return max(map(len, text.split()), default=0)


def stacked(
    headers: Sequence[str],
    rows: Sequence[Sequence[str]],
    right: Collection[str],
    available: int,
) -> Iterator[str]:
    r"""Write each row as a heading and, below it, names and values, for a narrow terminal.

    The heading is what stands before the first number, of a table without numbers its first cell.

    >>> print("\n".join(stacked(("a", "b", "n"), [("x", "y", "1")], ("n",), 20)))
    x, y
      n: 1
    """
    first = next((place for place, header in enumerate(headers) if header in right), 1)
    lead = max(1, first)
    for line in _stacked(headers, rows, lead, available):
        yield wrapped(line, available)


def _stacked(
    headers: Sequence[str], rows: Sequence[Sequence[str]], lead: int, available: int
) -> Iterator[str]:
    for row in rows:
        yield ", ".join(cell for cell in row[:lead] if cell)
        line = ""
        for header, cell in zip(headers[lead:], row[lead:], strict=True):
            part = f"{header}: {cell}"
            if line and len(_INDENT) + len(line) + len(part) + 2 > available:
                yield f"{_INDENT}{line},"
                line = part
            else:
                line = f"{line}, {part}" if line else part
        if line:
            yield f"{_INDENT}{line}"


def wrapped(line: str, available: int) -> str:
    r"""Go on in lines of their own, further in, where a line is too long; words stay whole.

    >>> print(wrapped("  one two three", 9))
      one two
        three
    """
    if len(line) <= available:
        return line
    start = line[: len(line) - len(line.lstrip())]
    return fill(
        line.strip(),
        available,
        initial_indent=start,
        subsequent_indent=start + _INDENT,
        break_long_words=False,
        break_on_hyphens=False,
    )


# --- Standard output kept for results: what code from outside prints goes to standard error -------

_STDOUT: Final = 1
_apart: list[TextIO] = []


def results() -> TextIO | None:
    """Return the stream that results are written to."""
    return _apart[-1] if _apart else sys.stdout


class _Shared(io.TextIOWrapper):
    """A stream of all code from outside: who closes it leaves it to the others."""

    def close(self) -> None:
        """Write what is still to be written."""
        self.flush()


@contextmanager
def results_apart() -> Iterator[None]:
    """Give results a stream of their own, and lay standard output onto standard error.

    A plug-in that prints, or a library below it, cannot get between the lines of a document; nor
    can one that closes its output. Worker processes inherit what is laid here. Where the streams
    are no files, as in a notebook, nothing changes.
    """
    normal = sys.stdout
    if _apart or normal is None or sys.stderr is None:
        yield
        return
    try:
        error, outputs = sys.stderr.fileno(), {normal.fileno(), _STDOUT}
        normal.flush()
        kept = {output: os.dup(output) for output in outputs}
    except (OSError, ValueError):
        yield
        return
    own = os.dup(kept[normal.fileno()])
    with open(own, "w", encoding=normal.encoding, errors=normal.errors) as stream:  # noqa: PTH123 - a descriptor
        _apart.append(stream)
        for output in outputs:
            os.dup2(error, output)
        laid.update(dict.fromkeys(outputs, own))
        printed = open(os.dup(error), "wb")  # noqa: PTH123, SIM115 - a descriptor
        sys.stdout = _Shared(printed, normal.encoding, normal.errors, line_buffering=True)
        try:
            yield
        finally:
            sys.stdout = normal
            printed.close()
            laid.clear()
            _apart.pop()
            # One that was closed meanwhile may be somebody else's by now.
            with suppress(OSError, ValueError):
                normal.flush()
            for output, before in kept.items():
                if _is_same(output, error):
                    os.dup2(before, output)
                os.close(before)


def _is_same(one: int, other: int) -> bool:
    """Tell whether two descriptors are of one file."""
    with suppress(OSError):
        return os.path.samestat(os.fstat(one), os.fstat(other))
    return False


# --- What the verbs print: results to standard output, talk to standard error, names made
# harmless.

Found = TypeVar("Found")

NONE: Final = "\N{EN DASH}"
"""Shown where there is no value."""
SHORT: Final = 10
"""Characters of a digest that people see; any unique beginning names it."""
_UNBOUNDED: Final = 100_000

_ESCAPED_IN_JSON: Final = re.compile(
    "[\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)


def emit(text: str) -> None:
    """Write a result to standard output; a reader that has gone away is no error."""
    _write(results(), text)


def emit_line(text: object) -> None:
    """Write one line of a result, made harmless."""
    emit(clean(text))


def emit_prose(text: object) -> None:
    """Write lines that people read, none wider than the terminal; a command is no such line."""
    available = width()
    emit("\n".join(wrapped(line, available) for line in clean(text, lines=True).split("\n")))


def emit_document(text: str) -> None:
    """Write what programs read, JSON or CSV: UTF-8 whatever the encoding of the terminal is."""
    _write(results(), text, is_utf8=True)


def talk(text: str) -> None:
    """Tell the person something on standard error; where that is full, the exit code has to do."""
    with suppress(OSError):
        _write(sys.stderr, text)


before_writing: Final[list[Callable[[], None]]] = []
"""Called before anything is written: what moves on a terminal makes room."""


def _write(stream: TextIO | None, text: str, *, is_utf8: bool = False) -> None:
    if stream is None:
        return
    for make_room in before_writing:
        make_room()
    line = text if text.endswith("\n") else f"{text}\n"
    # A stream that only keeps its text, as in a notebook, has no encoding to differ.
    binary = getattr(stream, "buffer", None) if is_utf8 else None
    try:
        if binary is None:
            stream.write(line)
        else:
            stream.flush()
            binary.write(line.encode("utf-8", "backslashreplace"))
        stream.flush()
    except BrokenPipeError:
        _silence(stream)
    except OSError:
        # Python flushes again when it ends, and would end with a code of its own.
        _silence(stream)
        raise


def _silence(stream: TextIO) -> None:
    """Send what is still buffered, and all that follows, nowhere."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, stream.fileno())
    except io.UnsupportedOperation:
        # A stream without a file keeps its text.
        return
    finally:
        os.close(nowhere)


def emit_json(verb: str, content: Mapping[str, Any]) -> None:
    """Write one JSON document with its schema, ``adeye/<verb>@1``."""
    emit_document(json_text(verb, content))


def emit_found(
    verb: str,
    found: Found,
    show: Callable[[Found], None],
    *,
    json: bool,
    document: Callable[[Found], Mapping[str, Any]] | None = None,
    looked_at: int = 1,
) -> None:
    """Write what a verb found: as one JSON document, or as people read it.

    Args:
        verb: For the schema of the document.
        found: What it found.
        show: Prints it for people.
        json: Whether it is written as a document.
        document: Makes its content; without it, that is a record with all its fields.
        looked_at: How many runs it is about; of none, nothing is told.
    """
    if json:
        emit_json(verb, plain(found) if document is None else document(found))
    else:
        show(found)
    if not looked_at:
        talk(f"{verb}: there is no run to look at, so nothing is shown by it.")
        raise Exit(ExitCode.INCOMPLETE)


def json_text(verb: str, content: Mapping[str, Any]) -> str:
    """Make one JSON document with its schema; what a terminal would obey is escaped."""
    document = {"schema": f"adeye/{verb}@1", **content}
    text = json.dumps(plain(document), indent=1, ensure_ascii=False, allow_nan=False)
    return _ESCAPED_IN_JSON.sub(lambda match: f"\\u{ord(match[0]):04x}", text)


def plain(value: Any) -> Any:
    """Turn records, enumerations and paths into JSON types; a number that is none becomes null.

    >>> plain({"a": (1.5, float("nan"))})
    {'a': [1.5, None]}
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = (field.name for field in dataclasses.fields(value))
        return {name: plain(getattr(value, name)) for name in fields}
    if hasattr(value, "model_dump"):
        value = value.model_dump(mode="json")
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, str | int | bool) else str(value)


def emit_csv(headers: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write comma-separated values with a line of headers."""
    emit_document(csv_text(headers, rows))


def csv_text(headers: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Make comma-separated values with a line of headers; no value is an empty field.

    What a spreadsheet would take for a formula is written as text, see ``report.cells``.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(map(csv_cell, headers))
    writer.writerows(map(csv_cell, row) for row in rows)
    return text.getvalue()


def emit_table(
    headers: Sequence[str],
    rows: Iterable[Sequence[object]],
    *,
    title: str = "",
    right: Collection[str] = (),
    sections: Collection[int] = (),
) -> None:
    """Write a table; where its columns do not fit, each row as a few lines.

    Args:
        headers: Names of the columns.
        rows: Cells: text, numbers, None, or styled text.
        title: Line above it.
        right: Headers of columns that are set flush right.
        sections: Numbers of rows that a line follows.
    """
    from rich import box
    from rich.table import Table

    cells = [list(map(_text, row)) for row in rows]
    plain_cells = [[cell.plain for cell in row] for row in cells]
    # What the box and the padding take beside the cells.
    available = width() - 3 * len(headers) + 1
    widths = widths_of(headers, plain_cells, right, available)
    if title:
        emit_prose(f"\n{clean(title)}")
    if widths is None:
        emit("\n".join(stacked(headers, plain_cells, right, width())))
        return
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for header, wide in zip(headers, widths, strict=True):
        justify = "right" if header in right else "left"
        table.add_column(_text(header), justify=justify, overflow="fold", width=wide)  # type: ignore[arg-type]
    for number, row in enumerate(cells):
        table.add_row(*row, end_section=number in sections)
    emit(_rendered(table))


def emit_records(
    records: Iterable[Found],
    columns: Mapping[str, str | Callable[[Found], object]],
    *,
    title: str = "",
    right: Collection[str] = (),
    sections: Collection[int] = (),
) -> None:
    """Write a table with a row for each record.

    Args:
        records: What is listed.
        columns: By header the field that a column shows, or what makes its cell of a record.
        title: As of a table, and so the others.
        right: See ``emit_table``.
        sections: See there, too.
    """
    rows = [
        [getattr(item, cell) if isinstance(cell, str) else cell(item) for cell in columns.values()]
        for item in records
    ]
    emit_table(tuple(columns), rows, title=title, right=right, sections=sections)


def emit_fields(fields: Mapping[str, object]) -> None:
    """Write names and values, one pair a line; what has no value is left out."""
    from rich.table import Table

    table = Table.grid(padding=(0, 2))
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    for name, value in fields.items():
        if value not in (None, "", (), []):
            table.add_row(_text(name), _text(value))
    emit(_rendered(table))


def emit_value(title: str, value: Any) -> None:
    """Write a value of whatever shape: records as a table, a mapping as fields, else one line."""
    if not value:
        return
    if isinstance(value, Mapping):
        if all(isinstance(item, Mapping) for item in value.values()):
            emit_value(title, [{"name": name, **item} for name, item in value.items()])
            return
        emit(f"\n{clean(title)}")
        emit_fields(value)
    elif isinstance(value, list | tuple) and all(isinstance(item, Mapping) for item in value):
        headers = list(dict.fromkeys(name for item in value for name in item))
        headers = [name for name in headers if any(_is_shown(item.get(name)) for item in value)]
        rows = [[item.get(name) for name in headers] for item in value]
        emit_table(headers, rows, title=title)
    else:
        emit(f"\n{clean(title)}: {format_value(value)}")


def _is_shown(value: Any) -> bool:
    return value is not None and value not in ("", [], {})


def format_value(value: object) -> str:
    """Write a value for people."""
    if value is None:
        return NONE
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        return ", ".join(format_value(item) for item in value) or NONE
    if isinstance(value, Mapping):
        return ", ".join(f"{key}={format_value(item)}" for key, item in value.items()) or NONE
    return clean(value)


def verdict_cell(verdict: Verdict | None) -> Text:
    """Write a verdict with its sign, so that none is told by colour alone."""
    from rich.text import Text

    from adeye.judge.verdict import Verdict
    from adeye.report.words import SYMBOLS, verdict_word

    styles = {Verdict.PASS: "green", Verdict.FAIL: "bold red", None: "dim"}
    return Text(f"{SYMBOLS[verdict]} {verdict_word(verdict)}", styles.get(verdict, "yellow"))


def short(digest: str | None) -> str:
    """Shorten a digest for people.

    >>> short("0123456789abcdef")
    '0123456789'
    """
    return digest[:SHORT] if digest else NONE


def wrote(path: Path) -> None:
    """Tell that a file was written."""
    talk(f"wrote {clean(path)}")


def listed(items: Iterable[object], *, of: Callable[[object], str] = str, most: int = 0) -> str:
    """Write names one after the other.

    Args:
        items: The names.
        of: Writes one.
        most: Characters after which the others are only counted; 0 for no limit. One is written.

    >>> listed(["a", "b"])
    'a, b'
    >>> listed(["one", "two", "three"], most=8)
    'one, two and 1 more'
    """
    texts = [of(item) for item in items]
    shown = len(texts)
    while most and shown > 1 and len(", ".join(texts[:shown])) > most:
        shown -= 1
    more = f" and {len(texts) - shown} more" if shown < len(texts) else ""
    return ", ".join(texts[:shown]) + more or NONE


def _text(value: object) -> Text:
    from rich.text import Text

    return value if isinstance(value, Text) else Text(format_value(value))


def width() -> int:
    """Return how many columns a line may have; where nobody looks, nothing is wrapped or cut."""
    from rich.console import Console

    stream = results()
    is_seen = stream is not None and stream.isatty()
    return Console().width if is_seen or "COLUMNS" in os.environ else _UNBOUNDED


def _rendered(renderable: Any) -> str:
    from rich.console import Console

    console = Console(width=width(), highlight=False)
    with console.capture() as capture:
        console.print(renderable)
    lines = (line.rstrip() for line in capture.get().splitlines())
    return "\n".join(lines).strip("\n")
