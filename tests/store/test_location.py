"""Where a database is: names of files, addresses of servers, and secrets that stay so."""

from pathlib import Path

import pytest

from adeye import supervision
from adeye.errors import InputError
from adeye.store.database import Database
from adeye.store.location import Location, locate, masked, option, without_secrets
from tests.refusals import refused
from tests.stored import stored

PLACES = stored("places")


@pytest.mark.parametrize(
    ("place", "path"),
    [
        (None, ".adeye/adeye.db"),
        ("a/b.db", "a/b.db"),
        (Path("a:b.db"), "a:b.db"),
        ("nightly.24", "nightly.24"),
        ("what?.db", "what?.db"),
        ("./~x.db", "~x.db"),
        ("sqlite:///a/b.db", "a/b.db"),
        ("sqlite:////a/b.db", "/a/b.db"),
    ],
)
def test_text_names_a_file(place: str | Path | None, path: str) -> None:
    assert locate(place).path == Path(path)


def test_location_of_a_server_names_everything_but_the_password() -> None:
    location = locate("postgresql://me:canary@host:6543/evidence?options=-csecret")
    assert str(location) == "postgresql://me@host:6543/evidence"
    assert "canary" not in repr(location)
    assert (location.is_server, location.path) == (True, None)
    assert location.url.password == "canary"  # noqa: S105 - shows where one is shown
    assert locate(location) is location
    assert locate("postgres://host/evidence").url.database == "evidence"
    # Files are named after their database; that of a file needs no parsing.
    assert locate("a/b.db").beside == Path("a/b.db")
    assert locate("postgresql://host/evidence").beside == Path(".adeye/evidence.postgresql")
    assert str(Location.of_file(Path("what://ever"))) == "what:/ever"


@pytest.mark.parametrize(
    ("url", "problem"),
    [
        ("mysql://me:canary@host/db", "mysql://… is not supported"),
        ("sqlite://", "is not supported"),
        ("sqlite:///:memory:", "is not supported"),
        ("postgresql://me:canary@host", "names no database"),
        ("postgresql://me:canary@host:port/db", "cannot be read as a URL"),
    ],
)
def test_other_locations_are_refused_without_their_password(url: str, problem: str) -> None:
    caught = refused(InputError, locate, url, says=problem)
    assert "canary" not in str(caught)
    assert caught.__cause__ is None


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        *((text, problem) for text, problem in PLACES["no file name"]),
        *((Path(text), problem) for text, problem in PLACES["no file name though a path"]),
    ],
)
def test_what_is_no_file_name_is_refused(text: str | Path, problem: str) -> None:
    caught = refused(InputError, locate, text, says=problem)
    assert "canary" not in str(caught)
    assert caught.remedy


SECRET = "p@s/s:w?o#r d%41é"  # noqa: S105 - made up
SPELT = "p%40s%2Fs%3Aw%3Fo%23r%20d%2541%C3%A9"
PARTS = ("p@s", "p%40s", "w?o", "w%3F", "w%3f", "o#r", "o%23r", "r d", "r%20d", "r+d", "d%2541")


LOWER = SPELT.replace("%2F", "%2f").replace("%3F", "%3f").replace("%3A", "%3a")
ADDRESSES = [
    text.format(spelt=SPELT, lower=LOWER, secret=SECRET) for text in PLACES["with a secret"]
]


@pytest.mark.parametrize("address", ADDRESSES)
@pytest.mark.parametrize("by_variable", [0, 1])
def test_no_word_about_an_address_holds_a_part_of_its_secret(
    address: str, by_variable: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    if by_variable:
        monkeypatch.setenv("ADEYE_DB", address)
    try:
        location = locate(address)
        said = [str(location), repr(location), option(address), option(location)]
    except InputError as error:
        said = [str(error), *map(str, (error.__cause__,))]
    said.append(masked(f"{address}: no such file"))
    assert not [(text, part) for text in said for part in PARTS if part in text]


@pytest.mark.parametrize(
    "typed",
    [
        *("pg://me:hunter@1@host/db", "//me:hunter@1@host/db", "me:hunter@1@host", "me:hunter@10"),
        *("mysql://me:hunter@10", "x://me:hunter@1?x=1", "local:hunter@1@host", "a:hunter@123"),
        *(
            "pg:/me:hunter@h/x",
            "adeye:hunter@1.host",
            "local:hunter@1$x",
            "x://local:hunter@1 said",
            "local:hunter@1:5432/db",
        ),
    ],
)
def test_password_before_a_number_is_masked(typed: str) -> None:
    assert "hunter" not in masked(f"SpecError: {typed}: there is no such file.")


@pytest.mark.parametrize("behind", ["", " is said", ", and", ".", ": least is nan", "' or so"])
def test_uid_of_a_metric_is_no_address(behind: str) -> None:
    said = f"metric local:top_speed@1{behind}"
    assert masked(said) == said


def test_password_behind_a_colon_that_is_spelt_is_masked() -> None:
    address = "postgresql://me%3Acanary@host/evidence"
    caught = refused(InputError, locate, address, says="cannot be read as a URL")
    assert "canary" not in f"{caught} {masked(address)}"


def test_command_names_the_variable_or_a_masked_address(monkeypatch: pytest.MonkeyPatch) -> None:
    address = f"postgresql://me:{SPELT}@host/evidence?sslmode=require"
    shown = " --db 'postgresql://me:***@host/evidence?sslmode=require'"
    assert option(address) == shown
    monkeypatch.setenv("ADEYE_DB", address)
    assert option(address) == ' --db "$ADEYE_DB"'
    with pytest.raises(InputError, match="is masked as"):
        locate(shown.split("'")[1])
    assert option(None) == option("") == ""
    assert option("my runs.db") == " --db 'my runs.db'"
    assert option("postgresql://me@host/evidence") == " --db postgresql://me@host/evidence"


@pytest.mark.parametrize(
    "spelt",
    [SPELT, SPELT.replace("%20", " "), SPELT.replace("%2F", "/"), SPELT.replace("%23", "#")],
)
def test_driver_gets_the_password_as_it_is(spelt: str) -> None:
    for address in (
        f"postgresql://me:{spelt}@host/evidence",
        f"postgresql://me@host/evidence?password={spelt.replace('#', '%23')}",
    ):
        assert locate(address).driver_arguments()["password"] == SECRET


def test_what_a_driver_quotes_is_masked() -> None:
    location = locate(f"postgresql://me:{SPELT}@host/evidence?sslpassword=other")
    for text in (SECRET, SPELT, SPELT.replace("%2F", "%2f"), repr(SECRET), "other"):
        said = location.without_secrets(f'invalid "{text}" given')
        assert not [part for part in (*PARTS, "other") if part in said]


def test_what_a_guest_quotes_of_the_environment_is_masked(monkeypatch: pytest.MonkeyPatch) -> None:
    address = "postgresql://me:Pl%40nt%20ed@host/db"
    monkeypatch.setattr(supervision, "_masks", [])
    raised = RuntimeError(f"{address} Pl@nt ed")
    monkeypatch.setenv("ADEYE_DB", address)
    assert supervision.said(raised) == str(raised)
    supervision.hide(without_secrets)
    assert supervision.said(raised) == "postgresql://me:***@host/db ***"
    monkeypatch.setenv("ADEYE_DB", "postgresql://me:half@a@host/db")
    assert supervision.said(raised).startswith("postgresql://me:***")
    monkeypatch.setenv("ADEYE_DB", "some.db")
    assert supervision.said(raised) == str(raised)


def test_what_a_guest_quotes_of_an_opened_database_is_masked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(supervision, "_masks", [])
    raised = RuntimeError("--db postgresql://me:pl4nt@host/db")
    assert supervision.said(raised) == str(raised)
    Database("postgresql://me:pl4nt@host/db").close()
    assert supervision.said(raised) == "--db postgresql://me:***@host/db"
