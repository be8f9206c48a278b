"""How a table fits a terminal: how wide its columns are, and what it is where they do not fit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

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
