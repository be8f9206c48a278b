"""The kinds of columns: what each may hold is in the statement that makes the table."""

from sqlalchemy import MetaData, Table
from sqlalchemy.dialects import sqlite
from sqlalchemy.schema import CreateTable

from adeye.store import evidence_tables as column_kinds


def test_gaps_are_allowed_only_where_they_are_said() -> None:
    table = Table(
        "made",
        MetaData(),
        column_kinds.text_column("word", key=True),
        column_kinds.text_column("remark", null=True),
        column_kinds.number_column("value"),
        column_kinds.count_column("rows"),
        column_kinds.flag_column("is_done"),
        column_kinds.row_hash_column(),
    )
    assert [column.name for column in table.columns if column.nullable] == ["remark", "value"]


def test_words_are_checked_by_the_database() -> None:
    word = column_kinds.text_column("word")
    rule = column_kinds.one_of("word", ("yes", "no"), "word")
    table = Table("said", MetaData(), word, rule)
    made = str(CreateTable(table).compile(dialect=sqlite.dialect()))
    assert "CHECK (word = 'yes' OR word = 'no')" in made
