"""Where a database is: a file of SQLite, or a database of a PostgreSQL server."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Self, TypeAlias

from sqlalchemy import URL, make_url
from sqlalchemy.exc import ArgumentError

from adeye.errors import InputError

DEFAULT_PATH: Final = Path(".adeye") / "adeye.db"
_SERVERS: Final = frozenset({"postgresql", "postgres"})
_FORMS: Final = "Give a path, sqlite:///PATH or postgresql://USER@HOST/DATABASE."


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
        shown = self.url.set(drivername="postgresql", query={}, password=None)
        return shown.render_as_string(hide_password=True)

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
        InputError: It is a URL of another kind, or incomplete.
    """
    if isinstance(place, Location):
        return place
    if place is None or place == "":
        return Location.of_file(DEFAULT_PATH)
    text = str(place)
    scheme, separator, rest = text.partition("://")
    if isinstance(place, Path) or not separator:
        return Location.of_file(Path(text))
    if scheme in _SERVERS:
        return _server(rest)
    path = rest.removeprefix("/")
    if scheme != "sqlite" or not path or path == ":memory:":
        # The URL may hold a password, so only its scheme is shown.
        raise InputError(f"database: {scheme}://… is not supported", remedy=_FORMS)
    return Location.of_file(Path(path))


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
