"""Where a database is: a file of SQLite, or a database of a PostgreSQL server."""

from __future__ import annotations

import os
import re
import unicodedata
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Self, TypeAlias

from sqlalchemy import URL, make_url
from sqlalchemy.exc import ArgumentError

from adeye.errors import InputError
from adeye.units import shown

DEFAULT_PATH: Final = Path(".adeye") / "adeye.db"
_SERVERS: Final = frozenset({"postgresql", "postgres"})
_FORMS: Final = "Give a path, sqlite:///PATH or postgresql://USER@HOST/DATABASE."
_NO_NAMES: Final = tuple(
    (re.compile(pattern, re.IGNORECASE | re.DOTALL), problem, remedy)
    for pattern, problem, remedy in (
        (r"\s*", "its name is empty", f"{_FORMS} Leave it out for {DEFAULT_PATH}."),
        (r".*:memory:.*", ":memory: is not supported, results would be gone", "Name a file."),
        (
            r"(sqlite|postgres(?:ql)?|file|mysql|mariadb|mssql|oracle|duckdb|jdbc|https?)"
            r"(?:\+\w+)?(?::|//).*",
            # What follows may hold a password.
            "{0}… is neither a URL with :// nor a path",
            _FORMS,
        ),
        (r"([^?]*)\?\w+=.*", "'{0}' is followed by ? and options, which are not read", _FORMS),
        (
            r"(~[^/]*).*",
            "{0} was not expanded by a shell",
            "Write the folder, or ./{0} for a file.",
        ),
        (r"(?:.*/)?(\$\{?\w+).*", "{0} was not put in by a shell", "Write what it stands for."),
        (r"(-.*)", "{0!r} stands where a name is expected", "Write ./{0} for a file of this name."),
        (r"(.*)/\.?", "{0!r} is a folder", "Name a file in it."),
    )
)
"""Texts that are no name of a file, why, and what to write instead."""


@dataclass(frozen=True, slots=True)
class Location:
    """A database by its place.

    Attributes:
        url: What the driver needs; it may hold a password, so nothing prints it.
        path: The file; None for a server.
    """

    url: URL = field(repr=False)
    path: Path | None

    @classmethod
    def of_file(cls, path: Path) -> Self:
        """Name a file."""
        return cls(URL.create("sqlite", database=str(path)), path)

    def __str__(self) -> str:
        """Name it for people, without a password."""
        if self.path is not None:
            return str(self.path)
        # What follows the database may hold a password, too.
        parts = self.url.username, None, self.url.host, self.url.port, self.url.database
        return str(URL.create("postgresql", *parts))

    @property
    def is_server(self) -> bool:
        """Whether it is on a server."""
        return self.path is None

    @property
    def beside(self) -> Path:
        """The file, or what stands for it: files that belong to the database are named after it."""
        if self.path is not None:
            return self.path
        return DEFAULT_PATH.with_name(f"{self.url.database}.postgresql")


Place: TypeAlias = str | Path | Location | None
"""What names a database: None is ``.adeye/adeye.db``."""


def locate(place: Place = None) -> Location:
    """Find the database that a text names.

    Args:
        place: A path, ``sqlite:///PATH``, ``postgresql://…``, or None for ``.adeye/adeye.db``.

    Raises:
        InputError: It is a URL of another kind, or incomplete, or no name of a file.
    """
    if isinstance(place, Location):
        return place
    if place is None:
        return Location.of_file(DEFAULT_PATH)
    if not isinstance(place, str | Path):
        raise InputError(f"database: {shown(place)} is neither text nor a path", remedy=_FORMS)
    text = str(place)
    scheme, separator, rest = text.partition("://")
    if isinstance(place, Path) or not separator:
        return Location.of_file(_file(text))
    if scheme in _SERVERS:
        return _server(rest)
    path = rest.removeprefix("/")
    if scheme != "sqlite" or not path:
        # The URL may hold a password, so only its scheme is shown.
        raise InputError(f"database: {scheme}://… is not supported", remedy=_FORMS)
    return Location.of_file(_file(path))


def _file(text: str) -> Path:
    """Check that a text is the name of a file, and nothing that another tool would read in it.

    Raises:
        InputError: It is not; SQLite would make a file of this name, and what is meant stay empty.
    """
    for pattern, problem, remedy in _NO_NAMES:
        if found := pattern.fullmatch(text):
            parts = found.groups()
            raise InputError(f"database: {problem.format(*parts)}", remedy=remedy.format(*parts))
    if any(unicodedata.category(sign) in {"Cc", "Zl", "Zp"} for sign in text):
        raise InputError(f"database: {shown(text)} has a control character", remedy="Remove it.")
    # Unlike those of Path these also know names that are too long to be any.
    if os.path.exists(text) and not os.path.isfile(text):  # noqa: PTH110, PTH113
        what = "a folder" if os.path.isdir(text) else "no regular file"  # noqa: PTH112
        raise InputError(f"database: {shown(text)} is {what}", remedy="Name a file.")
    return Path(text)


def _server(rest: str) -> Location:
    try:
        url = make_url(f"postgresql+psycopg://{rest}")
    except (ArgumentError, ValueError):
        # Neither what was raised nor what raised it may show the password.
        raise InputError(
            "database: postgresql://… cannot be read as a URL",
            remedy=f"{_FORMS} Write characters such as @ or / in a name as %40 or %2F.",
        ) from None
    if not url.database:
        raise InputError("database: postgresql://… names no database", remedy=_FORMS)
    return Location(url, None)
