"""``db`` and ``manifest`` on real files."""

from __future__ import annotations

import json
import sqlite3
from pathlib import Path
from typing import Any

import pytest

from adeye.store import schema
from adeye.store.read.query import run_query
from adeye.store.read.saved import SAVED, VIEWS
from adeye.store.records import ContentRecord
from adeye.store.repository import Repository
from adeye.store.write.merge import Merged
from tests.sql import alter, rows
from tests.store.conftest import Example
from tests.store.rows import complete_block

# --- ``db upgrade|info|verify`` on a real file


def test_upgrade_makes_then_finds_the_database(adeye: Any) -> None:
    assert adeye("db", "upgrade").out == f".adeye/adeye.db: schema none → {schema.head()}\n"
    assert adeye("db", "upgrade").out == f".adeye/adeye.db: schema {schema.head()} already\n"
    told = {"schema": "adeye/db-upgrade@1", "path": "x.db", "before": None, "after": schema.head()}
    assert adeye("db", "upgrade", "--db", "x.db", "--json").document == told


@pytest.mark.parametrize("verb", ["info", "verify"])
def test_reading_makes_no_database(adeye: Any, folder: Path, verb: str) -> None:
    assert "no such file" in adeye("db", verb).refused
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("verb", ["info", "verify", "upgrade"])
def test_other_file_is_an_environment_error(adeye: Any, folder: Path, verb: str) -> None:
    (folder / "text.db").write_text("not a database, but long enough to look like one\n" * 99)
    ended = adeye("db", verb, "--db", "text.db")
    assert (ended.code, ended.out) == (5, "")
    assert ended.err.startswith("PlatformError: ")


@pytest.fixture
def odd_db(folder: Path) -> Path:
    """A database with the content of an ODD."""
    with Repository.open(folder / "x.db") as repository:
        repository.save_content("odd", ContentRecord("first", "", {"odd": "first"}))
    return folder / "x.db"


def test_info_counts_rows(adeye: Any, odd_db: Path) -> None:
    assert odd_db.exists()
    document = adeye("db", "info", "--db", "x.db", "--json").document
    assert document["database_schema"] == schema.head()
    assert document["rows"]["odd"] == 1
    assert document["campaigns"] == []
    assert "odd" in adeye("db", "info", "--db", "x.db").out


def test_verify_names_an_altered_row_and_ends_with_4(adeye: Any, odd_db: Path) -> None:
    # It has no campaign, and nothing is altered yet.
    assert adeye("db", "verify", "--db", "x.db").code == 3
    alter(odd_db, "UPDATE odd SET id = 'second'")
    ended = adeye("db", "verify", "--db", "x.db")
    assert ended.code == 4
    assert any(line.startswith("odd ") for line in ended.out.splitlines())
    assert "IntegrityError" in ended.err
    ended = adeye("db", "verify", "--db", "x.db", "--json")
    assert ended.code == 4
    assert "odd" in {finding["table"] for finding in ended.document["findings"]}


def test_nothing_is_no_intact_database(adeye: Any) -> None:
    adeye("db", "upgrade", "--db", "empty.db").ok  # noqa: B018 - it has to end with 0
    ended = adeye("db", "verify", "--db", "empty.db")
    assert (ended.code, ended.out) == (3, "Nothing to verify: the database has no campaign.\n")


def test_rights_are_those_of_a_server(adeye: Any) -> None:
    assert "this database is a file" in adeye("db", "grant", "alice", "--db", "some.db").refused


def test_reading_is_granted_on_a_server(adeye: Any, server: Any) -> None:
    url = server.new_database()
    assert adeye("db", "upgrade", "--db", url).code == 0
    assert "adeye db grant" in adeye("query", "campaigns", "--db", url).refused
    assert adeye("db", "grant", "--db", url).out == "adeye_reader may read\n"
    assert adeye("query", "campaigns", "--db", url).code == 0
    unknown = adeye("db", "grant", "nobody_of_this_name", "--db", url)
    assert (unknown.code, unknown.out) == (2, "")
    assert "datasette shows files" in adeye("db", "metadata", "--db", url).err


@pytest.mark.slow
def test_merge_says_what_it_did(adeye: Any, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    schema.upgrade("other.db")
    found = Merged("other.db", ("c",), 1_000, 20_000, 3, 7)
    monkeypatch.setattr(Repository, "merge", lambda _here, _source: found)
    ended = adeye("db", "merge", "all.db", "other.db")
    assert ended.out == "other.db: campaigns 1, new runs 1,000, blocks done by it 3\n"
    assert "kept traces of 7 runs stay in other.db.traces" in ended.err
    document = adeye("db", "merge", "all.db", "other.db", "other.db", "--json").document
    assert [item["runs"] for item in document["sources"]] == [1_000, 1_000]
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    assert "none.db: no such file" in adeye("db", "merge", "new.db", "other.db", "none.db").refused
    (folder / "foreign.yaml").write_text("a: 1\n")
    assert adeye("db", "merge", "new.db", "foreign.yaml").code == 5
    # One that was altered is found out before anything is made, too.
    with sqlite3.connect(folder / "other.db") as raw:
        raw.execute("INSERT INTO uid_set VALUES (?, '[]', ?)", ("0" * 64, "0" * 64))
    assert adeye("db", "merge", "new.db", "other.db").code == 4
    assert not (folder / "new.db").exists()


# --- ``db metadata``: the form that datasette reads, true of the database that it is about


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
        found = connection.execute(content["sql"]).fetchall()
        assert found == list(run_query(mini.db, SAVED[query].sql).rows)
    connection.close()


@pytest.mark.slow
def test_every_view_and_its_columns_are_described(adeye: Any, mini: Any) -> None:
    document = adeye("db", "metadata", "--db", str(mini.db)).document
    tables = document["databases"][mini.db.stem]["tables"]
    views = {
        name: {row[1] for row in rows(mini.db, f"PRAGMA table_info({name})")}
        for (name,) in rows(mini.db, "SELECT name FROM sqlite_master WHERE type = 'view'")
    }
    assert tables.keys() == views.keys() >= VIEWS.keys()
    for name, columns in views.items():
        assert tables[name]["description"]
        assert tables[name]["columns"].keys() <= columns
    assert tables["v_runs"]["columns"]["max_jerk_mps3"].endswith("[m/s³]")
    assert tables["v_runs_cut_in"]["columns"]["gap_m"] == "[m]"


def test_database_is_not_overwritten(adeye: Any, mini: Any) -> None:
    before = mini.db.read_bytes()
    assert adeye("db", "metadata", "--db", str(mini.db), "-o", str(mini.db)).refused
    assert mini.db.read_bytes() == before


# --- ``manifest write|verify|keygen`` on a small campaign


@pytest.fixture
def campaign(folder: Path) -> str:
    with Repository.open(folder / "x.db") as repository:
        example = Example()
        plan = repository.plan_campaign(example.record(), example.cases(4))
        while (block := repository.claim_block(campaign=plan.campaign)) is not None:
            complete_block(repository, block, example.runs(block), example.judged(block))
        return plan.campaign


@pytest.mark.slow
def test_unsigned_manifest_tells_altered_files(adeye: Any, folder: Path, campaign: str) -> None:
    (folder / "report.html").write_text("green")
    written = adeye("manifest", "write", "--db", "x.db", "--file", "report.html", "--json").ok
    assert (written.document["campaign"], written.document["signature"]) == (campaign, None)
    done = adeye("manifest", "verify", "manifest.json", "--db", "x.db")
    assert "needs either --key or --unsigned" in done.refused
    verify = ("manifest", "verify", "manifest.json", "--unsigned", "--db", "x.db")
    assert adeye(*verify).out == "manifest.json: everything is as it says, unsigned.\n"
    only = ("manifest", "verify", "manifest.json", "--unsigned", "--files-only")
    said = "1 named file is as it says, unsigned; root, rows and traces were not looked at"
    assert adeye(*only).ok.out == f"manifest.json: {said}.\n"
    assert adeye(*only, "--json").document["checked"] == ["files"]
    assert adeye(*verify, "--json").document["checked"] == ["files", "root", "rows", "traces"]
    (folder / "report.html").write_text("red")
    ended = adeye(*verify, "--json")
    assert (ended.code, ended.document["findings"]) == (4, ["file report.html: is altered"])
    assert adeye(*verify).out == "file report.html: is altered\n"
    assert adeye(*only).code == 4


def test_signature_has_a_file_to_stand_beside(adeye: Any, folder: Path, campaign: str) -> None:
    assert folder.is_dir()
    assert campaign
    asked = ("manifest", "write", "--db", "x.db", "--sign", "k.pem", "-o", "/dev/stdout")
    assert "'/dev/stdout' is no file" in adeye(*asked).refused


def test_key_is_not_overwritten_by_the_signature(adeye: Any, folder: Path, campaign: str) -> None:
    pytest.importorskip("cryptography", reason="the extra `sign` is not installed")
    assert campaign
    for key, words in (("manifest.json.sig", "is a key"), ("k.pem", "")):
        assert adeye("manifest", "keygen", "--private", key, "--public", f"{key}.pub").code == 0
        before = (folder / key).read_bytes()
        for _ in range(2):
            ended = adeye("manifest", "write", "--db", "x.db", "--sign", key)
            assert (ended.code, words in ended.err) == (2 if words else 0, True)
        assert (folder / key).read_bytes() == before
        (folder / "manifest.json.sig").unlink()
    asked = ("query", "campaigns", "--db", "x.db", "-o", "manifest.json")
    assert "is a baseline, a manifest" in adeye(*asked).refused


@pytest.mark.slow
def test_signed_manifest_is_checked(adeye: Any, folder: Path, campaign: str) -> None:
    pytest.importorskip("cryptography", reason="the extra `sign` is not installed")
    assert campaign
    assert adeye("manifest", "keygen", "--private", "k.pem", "--public", "k.pub.pem").code == 0
    written = adeye("manifest", "write", "--db", "x.db", "--sign", "k.pem")
    assert "manifest.json.sig: signed" in written.out
    verify = ("manifest", "verify", "manifest.json", "--key", "k.pub.pem", "--db", "x.db")
    assert "signed with key" in adeye(*verify).out
    text = (folder / "manifest.json").read_text()
    (folder / "manifest.json").write_text(text.replace('"leaves": 4', '"leaves": 5'))
    ended = adeye(*verify)
    assert (ended.code, "is not what was signed" in ended.err) == (4, True)
