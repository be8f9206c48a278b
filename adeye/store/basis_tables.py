"""Tables of what it takes to judge a run again without its trace.

They are in no result hash: a run from before they were there is judged again by executing it.
"""

from __future__ import annotations

from typing import Final

from sqlalchemy import Column, ForeignKey, Integer, Table

from adeye.store.column_kinds import (
    count_column,
    digest_column,
    flag_column,
    metadata,
    number_column,
    row_hash_column,
    text_column,
)


def _run() -> Column[int]:
    key = ForeignKey("run.number")
    return Column("run_number", Integer, key, primary_key=True, autoincrement=False)


uid_set = Table(
    "uid_set", metadata, digest_column("digest", key=True), text_column("uids"), row_hash_column()
)
basis = Table(
    "basis",
    metadata,
    _run(),
    count_column("version", key=True),
    digest_column("uid_set_digest", "uid_set.digest"),
    flag_column("by_contact"),
    text_column("invalid", null=True),
    row_hash_column(),
)
extreme = Table(
    "extreme",
    metadata,
    _run(),
    text_column("measure", key=True),
    count_column("version", key=True),
    number_column("value"),
    number_column("time_s"),
    text_column("actor", null=True),
    text_column("samples"),
    row_hash_column(),
    sqlite_with_rowid=False,
)
kept_trace = Table(
    "kept_trace",
    metadata,
    _run(),
    text_column("file", key=True),
    count_column("place"),
    row_hash_column(),
)

RESULTS: Final = (basis, extreme, kept_trace)
"""Of these, the tables written a block at a time."""
