"""``db metadata``: the form that datasette reads, true of the database that it is about."""

import json
import sqlite3
from pathlib import Path
from typing import Any

import pytest

from adeye.cli.database import _VIEWS
from adeye.cli.queries import SAVED
from adeye.store.read.query import run_query


@pytest.mark.slow
def test_every_canned_query_answers_as_the_saved_one(adeye: Any, mini: Any, folder: Path) -> None:
    ended = adeye("db", "metadata", "--db", str(mini.db), "-o", "metadata.json")
    assert (ended.code, ended.out) == (0, "")
    document = json.loads((folder / "metadata.json").read_text("utf-8"))
    ((name, described),) = document["databases"].items()
    assert name == mini.db.stem
    assert list(described["queries"]) == list(SAVED)
    # Datasette opens the file read-only with the driver of Python, without our own settings.
    connection = sqlite3.connect(f"file:{mini.db}?mode=ro", uri=True)
    for query, content in described["queries"].items():
        assert content["title"] == query
        assert content["description"] == SAVED[query].text
        rows = connection.execute(content["sql"]).fetchall()
        assert rows == list(run_query(mini.db, SAVED[query].sql).rows)
    connection.close()


@pytest.mark.slow
def test_every_view_and_its_columns_are_described(adeye: Any, mini: Any) -> None:
    document = adeye("db", "metadata", "--db", str(mini.db)).document
    tables = document["databases"][mini.db.stem]["tables"]
    connection = sqlite3.connect(mini.db)
    views = {
        name: {row[1] for row in connection.execute(f"PRAGMA table_info({name})")}
        for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'view'")
    }
    connection.close()
    assert tables.keys() == views.keys() >= _VIEWS.keys()
    for name, columns in views.items():
        assert tables[name]["description"]
        assert tables[name]["columns"].keys() <= columns
    assert tables["v_runs"]["columns"]["max_jerk_mps3"].endswith("[m/s³]")
    assert tables["v_runs_cut_in"]["columns"]["gap_m"] == "[m]"


def test_database_is_not_overwritten(adeye: Any, mini: Any) -> None:
    before = mini.db.read_bytes()
    ended = adeye("db", "metadata", "--db", str(mini.db), "-o", str(mini.db))
    assert ended.code == 2
    assert mini.db.read_bytes() == before
