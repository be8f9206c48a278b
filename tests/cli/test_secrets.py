"""A password in the address of a server is in no output, file or row of any verb."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from adeye import supervision
from adeye.store import tables
from adeye.store.database import Database
from tests.cli.conftest import Verb
from tests.cli.test_foreign_parts import ELSEWHERE
from tests.cli.test_foreign_parts import VERBS as READING
from tests.postgres import Server
from tests.project import CANDIDATE, CONCEPT, MINI, Project
from tests.stored import stored

SPELT = "pl4nt%40d%20s3cr%2Ft%3F%25%C3%A9"
TRACES_OF_IT = ("pl4nt", "s3cr")
"""Parts that are in it however it is spelt."""
WORDS: dict[str, list[list[str]]] = {verb: [given] for verb, given in READING.items()}
WORDS |= stored("verbs")["secretive"]
"""Arguments of each verb that takes a database, with which it ends well and otherwise."""
WITHOUT = {"dependencies", "db metadata", "plan", "plugins", "sensors", "signals"}
"""Verbs that need no database."""


def test_every_verb_is_tried() -> None:
    assert WORDS.keys() | ELSEWHERE.keys() == READING.keys() | ELSEWHERE.keys()


@pytest.fixture
def secretive(server: Server) -> Iterator[Any]:
    """Return a function that names a new database with a password, which the server ignores."""
    made = []

    def name() -> str:
        made.append(server.new_database())
        return made[-1].replace("@/", f":{SPELT}@/", 1)

    yield name
    for url in made:
        server.drop(url)


def found_in(folder: Path, said: dict[str, str], *urls: str) -> list[str]:
    """Name the texts, files and tables that have a part of the secret."""
    texts = dict(said)
    for path in folder.rglob("*"):
        if path.is_file():
            texts[str(path)] = path.read_bytes().decode("utf-8", "replace")
    for url in urls:
        database = Database(url)
        with database.read() as connection:
            for table in tables.metadata.sorted_tables:
                texts[table.name] = repr(connection.execute(table.select()).all())
        database.close()
    return [name for name, text in texts.items() if any(part in text for part in TRACES_OF_IT)]


@pytest.mark.slow
@pytest.mark.parametrize("by_variable", [0, 1])
def test_no_output_of_any_verb_has_the_password_of_a_server(
    adeye: Verb, folder: Path, secretive: Any, by_variable: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    url, other = secretive(), secretive()
    project = Project(folder / "project", {**MINI, "scenarios": [MINI["scenarios"][0]]})
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"]["parameters"] = {"gap": ["30 m"]}
        odd["architectures"], odd["faults"] = odd["architectures"][1:], odd["faults"][1:]
    with project.edited(CONCEPT) as concept:
        # One that fails is in every output, with the command that shows it.
        for item in concept["requirements"]:
            item |= {"bound": {"metric": "min_distance_m", "at_least": 500.0}}
            item.pop("formula", None)
            item.pop("response", None)
        concept["requirements"] = concept["requirements"][:1]
    odd_file = "project/odd/tested.yaml"
    given = [] if by_variable else ["--db", url]
    if by_variable:
        monkeypatch.setenv("ADEYE_DB", url)
    monkeypatch.setenv("ADEYE_DEBUG", "1")
    said: dict[str, str] = {}

    def call(*words: str) -> int:
        done = adeye(*words)
        said[f"{len(said)} {' '.join(words[:2])}"] = done.out + done.err
        return done.code

    assert call("run", odd_file, "--quiet", *given) == 1
    # The user of the server may do everything, so that it asks in the name of another one.
    assert call("db", "grant", *given) == 0
    runs = [
        adeye("query", f"SELECT run FROM v_runs WHERE fault_entry {sign} 'none'", "--format", "csv",  # noqa: S608
              *given).out.split()[1]
        for sign in ("=", "<>")
    ]  # fmt: skip
    words = {
        "odd": odd_file,
        "architecture": "project/odd/architectures/camera_radar.yaml",
        "executor": "threads",
        "run": runs[0],
        "fault": runs[1],
        "other": other,
    }
    ended = {}
    for verb, all_arguments in WORDS.items():
        if verb in WITHOUT:
            continue
        ended[verb] = [
            call(*verb.split(), *(item.format(**words) for item in arguments), *given)
            for arguments in all_arguments
        ]
    # A tiny campaign has nothing to compare or to halve; the others have said all that they say.
    silent = {verb for verb, codes in ended.items() if codes[0] not in {0, 1, 3}}
    assert silent <= {"uncertainty", "compare", "certify", "manifest verify"}, ended
    assert ended["db copy"] == [0, 2, 0]
    with project.edited_odd() as odd:
        odd["seed"] = 8
    call("stale", odd_file, *given)
    call("judge", odd_file, *given)
    for into, source in (("merged.db", url), (url, "merged.db"), (url, url)):
        call("db", "merge", into, source)
    for wrong in (url.replace("@/d", "@/e"), url.replace("tester", "nobody"),
                  url.replace("host=", "hots="), url.replace("%25", "%"), url.replace("%40", "@"),
                  f"postgresql://tester:{SPELT}@127.0.0.1:1/x"):  # fmt: skip
        call("db", "info", "--db", wrong)
        call("run", odd_file, "--db", wrong)
    assert found_in(folder, said, url, other) == []
    # What is looked for would be found.
    assert found_in(folder, {"this": url}) == ["this"]


QUOTING = """
import os


class Quoting:
    def __init__(self, parameters, context):
        pass

    def act(self, observation):
        raise RuntimeError(os.environ["ADEYE_DB"])
"""


@pytest.mark.parametrize("lanes", ["--workers", "--threads"])
def test_guest_that_quotes_the_environment_tells_no_secret(
    adeye: Verb, folder: Path, secretive: Any, lanes: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = secretive()
    project = Project(folder / "project", {**MINI, "scenarios": [MINI["scenarios"][0]]})
    (project.odd.parent / "architectures" / "quoting.py").write_text(QUOTING, "utf-8")
    with project.edited(CANDIDATE) as candidate:
        channel = {"kind": "./quoting.py:Quoting", "links": ["localisation"]}
        candidate["channels"]["nominal"] = channel
    monkeypatch.setenv("ADEYE_DB", url)
    told = adeye("run", str(project.odd), lanes, "2", "--junit", "j.xml", "--report-json", "r.json")
    assert "channel_error of channel nominal" in told.out + told.err
    assert "RuntimeError: postgresql://" in (folder / "j.xml").read_text("utf-8")
    assert found_in(folder, {"out": told.out, "err": told.err}, url) == []


def test_plugin_that_quotes_the_environment_when_it_is_read_tells_no_secret(
    adeye: Verb, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No database is opened to plan."""
    project = Project(folder / "project", MINI)
    text = "import os\nraise RuntimeError(os.environ['ADEYE_DB'].partition('@')[0][16:])"
    (project.odd.parent / "quoting.py").write_text(text, "utf-8")
    with project.edited_odd() as odd:
        odd["plugins"] = ["./quoting.py:Quoting"]
    monkeypatch.setattr(supervision, "_masks", [])
    monkeypatch.setenv("ADEYE_DB", f"postgresql://me:{SPELT}@127.0.0.1:9/db")
    told = adeye("plan", str(project.odd)).refused
    assert "RuntimeError: ***" in told
    assert found_in(folder / "none", {"err": told}) == []
