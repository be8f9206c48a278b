r"""Text that others wrote, made harmless for whatever shows it: a terminal, a spreadsheet.

>>> clean("cut\x1b[31m_in"), csv_cell("=HYPERLINK(1)"), csv_cell("-1.5")
('cut[31m_in', "'=HYPERLINK(1)", '-1.5')
"""

from __future__ import annotations

import re
from typing import Any, Final

# C0 and C1 controls, DEL, and the marks that turn the direction of text around.
_CONTROL: Final = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")
_CONTROL_BUT_LINES: Final = re.compile(
    "[\x00-\x09\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]"
)
# Signs that begin a formula, also in their full width; blanks before them do not help.
_FORMULA: Final = re.compile(r"\s*[=+\-@\uff1d\uff0b\uff0d\uff20].")
_NUMBER: Final = re.compile(r"\s*[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?\s*")


def clean(text: object, *, lines: bool = False) -> str:
    r"""Remove what a terminal would obey instead of show.

    Args:
        text: Whatever somebody wrote into a file or the database.
        lines: Whether line breaks stay.

    >>> clean("cut\x1b[31m_in")
    'cut[31m_in'
    """
    pattern = _CONTROL_BUT_LINES if lines else _CONTROL
    return pattern.sub(lambda match: " " if match[0] in "\t\n" else "", str(text))


def csv_cell(value: Any) -> Any:
    """Make a cell of a CSV file that neither a terminal nor a spreadsheet obeys.

    Text loses control characters; what a spreadsheet would take for a formula gets an apostrophe
    in front, which it shows as text. Numbers stay as they are, also written ones, and truth values
    are ``true`` and ``false``.

    Args:
        value: Text, a number, a truth value, None; anything else is written as text.

    >>> csv_cell("@sum"), csv_cell("+3.5"), csv_cell(-2.0), csv_cell(True), csv_cell(None)
    ("'@sum", '+3.5', -2.0, 'true', None)
    """
    if value is None or isinstance(value, int | float):
        return str(value).lower() if isinstance(value, bool) else value
    text = clean(value.hex() if isinstance(value, bytes) else value)
    if _FORMULA.match(text) and not _NUMBER.fullmatch(text):
        return f"'{text}"
    return text
