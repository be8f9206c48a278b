"""The collection of tables and the kinds of columns that they are made of."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sqlalchemy import (
    Boolean,
    CheckConstraint,
    Column,
    ColumnElement,
    Float,
    ForeignKey,
    Integer,
    MetaData,
    SmallInteger,
    String,
    Text,
    literal_column,
)

if TYPE_CHECKING:
    from sqlalchemy.types import TypeEngine

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


def is_true(flag: ColumnElement[bool]) -> ColumnElement[bool]:
    """Ask for a flag, which is a number in the database."""
    return flag == literal_column("1")


def digest_column(name: str, references: str | None = None, *, key: bool = False) -> Column[str]:
    """Make a column of sha256 in hex."""
    keys = [] if references is None else [ForeignKey(references)]
    return Column(name, coded(64), *keys, primary_key=key, nullable=False)


def text_column(name: str, *, key: bool = False, null: bool = False) -> Column[str]:
    """Make a column of text."""
    return Column(name, TEXT, primary_key=key, nullable=null)


def number_column(name: str, *, null: bool = True) -> Column[float]:
    """Make a column of numbers, by default with gaps."""
    return Column(name, Float, nullable=null)


def count_column(name: str, *, key: bool = False) -> Column[int]:
    """Make a column of whole numbers."""
    return Column(name, Integer, primary_key=key, nullable=False, autoincrement=False)


def flag_column(name: str) -> Column[bool]:
    """Make a column of truth values."""
    return Column(name, _FLAG, nullable=False)


def row_hash_column() -> Column[str]:
    """Make the last column of a table that is only added to."""
    return Column("row_hash", coded(32), nullable=False)


def one_of(column: str, words: tuple[str, ...], name: str) -> CheckConstraint:
    """Let a column of text have some words only."""
    # SQLite makes a table of what follows IN, for every row that it checks.
    return CheckConstraint(" OR ".join(f"{column} = '{word}'" for word in words), name=name)
