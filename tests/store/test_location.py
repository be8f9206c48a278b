from pathlib import Path

import pytest

from adeye.errors import InputError
from adeye.store.location import Location, locate


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
    assert location.is_server
    assert location.path is None
    assert location.url.password == "canary"  # noqa: S105 - shows where one is shown
    assert locate(location) is location
    assert locate("postgres://host/evidence").url.database == "evidence"


def test_files_are_named_after_their_database() -> None:
    assert locate("a/b.db").beside == Path("a/b.db")
    assert locate("postgresql://host/evidence").beside == Path(".adeye/evidence.postgresql")


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
    with pytest.raises(InputError, match=problem) as caught:
        locate(url)
    assert "canary" not in str(caught.value)
    assert caught.value.__cause__ is None


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "its name is empty"),
        (" ", "its name is empty"),
        (":memory:", "would be gone"),
        ("postgresql:team", "postgresql… is neither"),
        ("postgresql:/me:canary@host/team", "postgresql… is neither"),
        ("postgresql//me:canary@host/team", "postgresql… is neither"),
        (Path("postgresql://me:canary@host/team"), "postgresql… is neither"),
        ("sqlite:x.db", "sqlite… is neither"),
        ("sqlite:/x.db", "sqlite… is neither"),
        ("file:x.db?mode=ro", "file… is neither"),
        ("a.db?mode=ro", "followed by . and options"),
        ("sqlite:///a.db?mode=ro", "followed by . and options"),
        ("~/x.db", "~ was not expanded"),
        (Path("~/x.db"), "~ was not expanded"),
        ("$HOME/x.db", "HOME was not put in"),
        ("${HOME}/x.db", "HOME was not put in"),
        ("a\nb.db", "has a control character"),
        ("a\0.db", "has a control character"),
        ("-x.db", "stands where a name"),
        ("new/", "is a folder"),
        (".", "is a folder"),
        ("/dev/null", "is no regular file"),
    ],
)
def test_what_is_no_file_name_is_refused(text: str | Path, problem: str) -> None:
    with pytest.raises(InputError, match=problem) as caught:
        locate(text)
    assert "canary" not in str(caught.value)
    assert caught.value.remedy


def test_location_of_a_file_needs_no_parsing() -> None:
    assert str(Location.of_file(Path("what://ever"))) == "what:/ever"
