"""Tables of what it takes to judge a run again without its trace.

They are in no result hash: a run from before they were there is judged again by executing it.
"""

from __future__ import annotations

from typing import Final

from sqlalchemy import Column, ForeignKey, Integer, Table

from adeye.store import column_kinds

_digest, _text = column_kinds.digest_column, column_kinds.text_column
_number, _count = column_kinds.number_column, column_kinds.count_column
_flag, _row_hash = column_kinds.flag_column, column_kinds.row_hash_column


def _run() -> Column[int]:
    key = ForeignKey("run.number")
    return Column("run_number", Integer, key, primary_key=True, autoincrement=False)


uid_set = Table(
    "uid_set", column_kinds.metadata, _digest("digest", key=True), _text("uids"), _row_hash()
)
basis = Table(
    "basis",
    column_kinds.metadata,
    _run(),
    _count("version", key=True),
    _digest("uid_set_digest", "uid_set.digest"),
    _flag("by_contact"),
    _text("invalid", null=True),
    _row_hash(),
)
extreme = Table(
    "extreme",
    column_kinds.metadata,
    _run(),
    _text("measure", key=True),
    _count("version", key=True),
    _number("value"),
    _number("time_s"),
    _text("actor", null=True),
    _text("samples"),
    _row_hash(),
    sqlite_with_rowid=False,
)
kept_trace = Table(
    "kept_trace",
    column_kinds.metadata,
    _run(),
    _text("file", key=True),
    _count("place"),
    _row_hash(),
)

RESULTS: Final = (basis, extreme, kept_trace)
"""Of these, the tables written a block at a time."""
