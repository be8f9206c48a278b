"""``db upgrade|info|verify`` on a real file."""

import sqlite3
from pathlib import Path
from typing import Any

import pytest

from adeye.store import schema
from adeye.store.records import ContentRecord
from adeye.store.repository import Repository
from adeye.store.write.merge import Merged


def test_upgrade_makes_then_finds_the_database(adeye: Any) -> None:
    assert adeye("db", "upgrade").out == f".adeye/adeye.db: schema none → {schema.head()}\n"
    assert adeye("db", "upgrade").out == f".adeye/adeye.db: schema {schema.head()} already\n"


def test_upgrade_json(adeye: Any) -> None:
    assert adeye("db", "upgrade", "--db", "x.db", "--json").document == {
        "schema": "adeye/db-upgrade@1",
        "path": "x.db",
        "before": None,
        "after": schema.head(),
    }


@pytest.mark.parametrize("verb", ["info", "verify"])
def test_reading_makes_no_database(adeye: Any, folder: Path, verb: str) -> None:
    ended = adeye("db", verb)
    assert ended.code == 2
    assert "no such file" in ended.err
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("verb", ["info", "verify", "upgrade"])
def test_other_file_is_an_environment_error(adeye: Any, folder: Path, verb: str) -> None:
    (folder / "text.db").write_text("not a database, but long enough to look like one\n" * 99)
    ended = adeye("db", verb, "--db", "text.db")
    assert (ended.code, ended.out) == (5, "")
    assert ended.err.startswith("PlatformError: ")


@pytest.mark.slow
def test_info_counts_rows(adeye: Any, folder: Path) -> None:
    with Repository.open(folder / "x.db") as repository:
        repository.save_content("odd", ContentRecord("first", "", {"odd": "first"}))
    document = adeye("db", "info", "--db", "x.db", "--json").document
    assert document["schema"] == "adeye/db-info@1"
    assert document["database_schema"] == schema.head()
    assert document["rows"]["odd"] == 1
    assert document["campaigns"] == []
    assert "odd" in adeye("db", "info", "--db", "x.db").out


@pytest.mark.slow
def test_verify_names_an_altered_row_and_ends_with_4(adeye: Any, folder: Path) -> None:
    path = folder / "x.db"
    with Repository.open(path) as repository:
        repository.save_content("odd", ContentRecord("first", "", {"odd": "first"}))
    assert adeye("db", "verify", "--db", "x.db").code == 0
    with sqlite3.connect(path) as connection:
        for (trigger,) in connection.execute("SELECT name FROM sqlite_master WHERE type='trigger'"):
            connection.execute(f"DROP TRIGGER {trigger}")
        connection.execute("UPDATE odd SET id = 'second'")
    connection.close()
    ended = adeye("db", "verify", "--db", "x.db")
    assert ended.code == 4
    assert any(line.startswith("odd ") for line in ended.out.splitlines())
    assert "IntegrityError" in ended.err
    document = adeye("db", "verify", "--db", "x.db", "--json")
    assert document.code == 4
    assert "odd" in {finding["table"] for finding in document.document["findings"]}


def test_rights_are_those_of_a_server(adeye: Any) -> None:
    ended = adeye("db", "grant", "alice", "--db", "some.db")
    assert (ended.code, ended.out) == (2, "")
    assert "this database is a file" in ended.err


def test_reading_is_granted_on_a_server(adeye: Any, server: Any) -> None:
    url = server.new_database()
    assert adeye("db", "upgrade", "--db", url).code == 0
    refused = adeye("query", "campaigns", "--db", url)
    assert (refused.code, refused.out) == (2, "")
    assert "adeye db grant" in refused.err
    assert adeye("db", "grant", "--db", url).out == "adeye_reader may read\n"
    assert adeye("query", "campaigns", "--db", url).code == 0
    unknown = adeye("db", "grant", "nobody_of_this_name", "--db", url)
    assert (unknown.code, unknown.out) == (5, "")
    assert "datasette shows files" in adeye("db", "metadata", "--db", url).err


@pytest.mark.slow
def test_merge_says_what_came_over_and_needs_its_sources(
    adeye: Any, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    schema.upgrade("other.db")
    found = Merged("other.db", ("c",), 1_000, 20_000, 3, 7)
    monkeypatch.setattr(Repository, "merge", lambda _here, _source: found)
    ended = adeye("db", "merge", "all.db", "other.db")
    assert ended.out == "other.db: campaigns 1, new runs 1,000, blocks done by it 3\n"
    assert "kept traces of 7 runs stay in other.db.traces" in ended.err
    document = adeye("db", "merge", "all.db", "other.db", "other.db", "--json").document
    assert document["schema"] == "adeye/db-merge@1"
    assert [item["runs"] for item in document["sources"]] == [1_000, 1_000]
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    ended = adeye("db", "merge", "new.db", "other.db", "none.db")
    assert (ended.code, "none.db: no such file" in ended.err) == (2, True)
    (folder / "foreign.yaml").write_text("a: 1\n")
    assert adeye("db", "merge", "new.db", "foreign.yaml").code == 5
    # One that was altered is found out before anything is made, too.
    with sqlite3.connect(folder / "other.db") as raw:
        raw.execute("INSERT INTO uid_set VALUES (?, '[]', ?)", ("0" * 64, "0" * 64))
    assert adeye("db", "merge", "new.db", "other.db").code == 4
    assert not (folder / "new.db").exists()
