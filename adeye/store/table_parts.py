"""What tables are made of: the collection that they are in, kinds of columns, and their words."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from sqlalchemy import (
    Boolean,
    CheckConstraint,
    Column,
    Float,
    ForeignKey,
    Integer,
    MetaData,
    SmallInteger,
    String,
    Table,
    Text,
)
from sqlalchemy.schema import SchemaItem
from sqlalchemy.types import TypeEngine

# --- The collection of tables and the kinds of columns that they are made of ----------------------

metadata = MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "ck": "ck_%(table_name)s_%(constraint_name)s",
        "fk": "fk_%(table_name)s_%(column_0_N_name)s",
        "pk": "pk_%(table_name)s",
    }
)


# Texts are in the order of their bytes, in every database and language.
TEXT: TypeEngine[str] = Text().with_variant(Text(collation="C"), "postgresql")
# Numbers, as SQLite has it: one reading for whoever writes SQL.
_FLAG: TypeEngine[bool] = Boolean().with_variant(SmallInteger(), "postgresql")


def coded(length: int) -> TypeEngine[str]:
    """Give the type of a text of a fixed length, such as a digest."""
    return String(length).with_variant(String(length, collation="C"), "postgresql")


def digest_column(name: str, references: str | None = None, *, key: bool = False) -> Column[str]:
    """Make a column of sha256 in hex."""
    keys = [] if references is None else [ForeignKey(references)]
    return Column(name, coded(64), *keys, primary_key=key, nullable=False)


def row_hash_column() -> Column[str]:
    """Make the last column of a table that is only added to."""
    return Column("row_hash", coded(32), nullable=False)


def texts(*names: str, key: bool = False, null: bool = False) -> list[Column[str]]:
    """Make columns of text."""
    return [Column(name, TEXT, primary_key=key, nullable=null) for name in names]


def numbers(*names: str, null: bool = True) -> list[Column[float]]:
    """Make columns of numbers, by default with gaps."""
    return [Column(name, Float, nullable=null) for name in names]


def counts(*names: str, key: bool = False) -> list[Column[int]]:
    """Make columns of whole numbers."""
    return [
        Column(name, Integer, primary_key=key, nullable=False, autoincrement=False)
        for name in names
    ]


def flags(*names: str) -> list[Column[bool]]:
    """Make columns of truth values."""
    return [Column(name, _FLAG, nullable=False) for name in names]


def insert_only(name: str, *columns: SchemaItem, with_rowid: bool = True) -> Table:
    """Make a table that is only added to: behind its columns stands the hash of the row."""
    return Table(name, metadata, *columns, row_hash_column(), sqlite_with_rowid=with_rowid)


def one_of(column: str, words: tuple[str, ...], name: str) -> CheckConstraint:
    """Let a column of text have some words only."""
    # SQLite makes a table of what follows IN, for every row that it checks.
    return CheckConstraint(" OR ".join(f"{column} = '{word}'" for word in words), name=name)


def place_number() -> Column[int]:
    """Make the key of what is numbered as it comes in."""
    return Column("number", Integer, primary_key=True, autoincrement=False)


def campaign_column(*, key: bool = False) -> Column[str]:
    """Refer to a campaign."""
    return Column(
        "campaign_id", coded(32), ForeignKey("campaign.id"), primary_key=key, nullable=False
    )


def run_number(number: str | Column[int] = "run.number") -> Column[int]:
    """Refer to a run by its number: digests would scatter the rows of a block over the file."""
    key = ForeignKey(number)
    return Column("run_number", Integer, key, primary_key=True, autoincrement=False)


# --- Built-in metrics by the table that holds them ------------------------------------------------


def _metric_tables() -> dict[str, tuple[str, ...]]:
    found: dict[str, list[str]] = {}
    for line in Path(__file__).with_name("metric_tables.txt").read_text("utf-8").splitlines():
        if line.startswith("["):
            found[line.strip("[]")] = own = []
        elif line and not line.startswith("#"):
            own.append(line)
    return {table: tuple(names) for table, names in found.items()}


TABLES: Final = _metric_tables()
"""Built-in metrics by the table that holds them, see ``metric_tables.txt``."""

METRIC_IDS: Final = tuple(name for names in TABLES.values() for name in names)
"""All of them, four columns each: value, status, time of the worst case, actor."""


# --- Words that columns have ----------------------------------------------------------------------

METRIC_STATUSES: Final = (
    "value", "no_conflict", "not_applicable", "undefined", "incomplete", "error"
)  # fmt: skip
WORK_STATES: Final = ("pending", "leased", "done", "quarantined")
RUN_VERDICTS: Final = ("PASS", "FAIL", "INCONCLUSIVE", "VACUOUS", "INVALID", "ERROR")
"""Verdicts that a row can have; NOT_RUN is the absence of a row."""

INJECTION_CLASSES: Final = (
    "not_activated", "masked", "detected_in_time", "detected_late", "undetected_no_violation",
    "undetected_violation",
)  # fmt: skip
TAKEOVER_CLASSES: Final = ("needed_and_done", "late", "spurious", "missed", "not_needed")
MOMENTS: Final = (
    "fault", "effect", "deviation", "detect", "switch", "brake", "emergency", "safe", "violation"
)  # fmt: skip
"""Times of a timeline."""
INTERVALS: Final = ("fdti", "frti", "fhti", "eoti", "ftti")
"""Intervals between them."""
