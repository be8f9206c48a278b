"""Where a database is: a file of SQLite, or a database of a PostgreSQL server.

An address may hold a password. Whoever prints one takes ``str`` of a location, or ``option`` for a
command; ``masked`` is for texts that may quote what a person typed.
"""

from __future__ import annotations

import os
import re
import shlex
import unicodedata
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self, TypeAlias
from urllib.parse import quote_plus

from adeye.errors import InputError
from adeye.outputs import BESIDE_DATABASE, KEPT_FOLDER
from adeye.units import shown

if TYPE_CHECKING:
    # Whoever only masks a message does without it: importing it takes a fifth of a second.
    from sqlalchemy import URL

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
        (
            r"/{0,2}[^/\s:@]+:[^@]*@.*",
            "it looks like the address of a server, with a password and without its scheme",
            _FORMS,
        ),
        (r"([^?]*)\?\w+=.*", "'{0}' is followed by ? and options, which are not read", _FORMS),
        (
            r"(~[^/]*).*",
            "{0} was not expanded by a shell",
            "Write the folder, or ./{0} for a file.",
        ),
        (
            r"(?:.*/)?(\$\{?\w+|%\w+%).*",
            "{0} was not put in by a shell",
            "Write what it stands for.",
        ),
        (r"([a-z]:\\.*)", "{0!r} is a path of another system", "Write one of this system."),
        (
            # SQLite deletes it, or takes it for what it has to bring back.
            rf"(?:.*/)?([^/]*(?:{'|'.join(BESIDE_DATABASE)}))",
            "{0!r} is the name of a file that SQLite keeps beside another database",
            "Give it another ending, such as .db.",
        ),
        (
            rf"(?:.*/)?([^/]*{re.escape(KEPT_FOLDER)})(?:/[^/]*)?",
            "{0!r} is the name of a folder of kept traces",
            "Give it another ending, such as .db, and a folder of another name.",
        ),
        (r"(-.*)", "{0!r} stands where a name is expected", "Write ./{0} for a file of this name."),
        (r"(.*)/\.?", "{0!r} is a folder", "Name a file in it."),
    )
)
"""Texts that are no name of a file, why, and what to write instead."""
VARIABLE: Final = "ADEYE_DB"
"""Environment variable that names the database."""
_MASK: Final = "***"
_SHOWN: Final = frozenset(
    {"application_name", "connect_timeout", "dbname", "host", "hostaddr", "passfile", "port"}
    | {"service", "sslcert", "sslkey", "sslmode", "sslrootcert", "target_session_attrs", "user"}
)
"""Parameters of an address that hold no secret; what others hold is not known."""
_SECRETS: Final = ("password", "sslpassword")
_LIKE_A_SERVER: Final = re.compile(r"\s*postgres\w*(\+\w+)?:|.*passw(or)?d\s*=", re.I | re.S)
_UID: Final = r"(?:adeye|local):[\w.]+@\d+(?![^\s'\",.:]|[.:]\w)"
_TYPED: Final = re.compile(
    r"(\bpostgres\w*(?:\+\w+)?:/*[^\s:@]*:).*@[^\s'\"]*|"
    # A word is looked at from its beginning only, and so far: a message may quote a whole file. The
    # uid of a metric is no address.
    r"((?:(?<!\w)\w+:/{1,2}|//)[^\s:/@'\"]*(?::|%3a)|(?<![\w/])(?!" + _UID + r")\w+:)"
    r"[^\s/@'\"]{1,999}@[^\s'\"]*|"
    r"(passw(?:or)?d\s*=\s*)(?:'[^']*'|[^\s&'\"]+)",
    re.I,
)


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
        from sqlalchemy import URL

        return cls(URL.create("sqlite", database=str(path)), path)

    @property
    def secrets(self) -> tuple[str, ...]:
        """Passwords that its address holds."""
        held = [self.url.password, *(self.url.query.get(name) for name in _SECRETS)]
        flat = (one for item in held for one in (item if isinstance(item, tuple) else (item,)))
        return tuple(str(item) for item in flat if item)

    def without_secrets(self, text: str) -> str:
        """Mask the passwords of its address in a text, however they are spelt there."""
        for secret in self.secrets:
            text = re.sub("".join(map(_spellings, secret)), _MASK, text)
        return text

    def driver_arguments(self) -> dict[str, Any]:
        """What the driver of the server needs, as every verb gives it."""
        from sqlalchemy.dialects.postgresql.psycopg import PGDialect_psycopg

        dialect: Any = PGDialect_psycopg  # its class has no types
        return dict(dialect().create_connect_args(self.url)[1])

    def __str__(self) -> str:
        """Name it for people, without a password."""
        from sqlalchemy import URL

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
    if isinstance(place, Path):
        return Location.of_file(_file(text))
    if not separator:
        if _LIKE_A_SERVER.match(text):
            raise InputError("database: an address of a server has another form", remedy=_FORMS)
        return Location.of_file(_file(text))
    if scheme in _SERVERS:
        return _server(rest)
    path = rest.removeprefix("/")
    if scheme != "sqlite" or not path:
        # The URL may hold a password, so only its scheme is shown.
        raise InputError(f"database: {scheme}://… is not supported", remedy=_FORMS)
    file = _file(path)
    if path == rest:
        # With two slashes the first part would be the name of a host.
        raise InputError("database: sqlite://… lacks a third slash", remedy=_FORMS)
    return Location.of_file(file)


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
    try:
        os.fsencode(text)
    except UnicodeEncodeError as error:
        said = f"database: {shown(text)} is the name of no file: it has half of a character"
        raise InputError(said, remedy=_FORMS) from error
    # Unlike those of Path these also know names that are too long to be any.
    if os.path.exists(text) and not os.path.isfile(text):  # noqa: PTH110, PTH113
        what = "a folder" if os.path.isdir(text) else "no regular file"  # noqa: PTH112
        raise InputError(f"database: {shown(text)} is {what}", remedy="Name a file.")
    return Path(text)


def _server(rest: str) -> Location:
    from sqlalchemy import make_url
    from sqlalchemy.exc import ArgumentError

    # With an @ in a password, a part of it would be taken for the name of the host, and shown.
    if rest.count("@") > 1 or "@" in rest.partition("?")[2]:
        raise _unreadable()
    try:
        url = make_url(f"postgresql+psycopg://{rest}")
    except (ArgumentError, ValueError):
        # Neither what was raised nor what raised it may show the password.
        raise _unreadable() from None
    # A colon that is written as %3A makes one name of a user and a password, which is shown.
    if ("@" in rest and url.username is None) or ":" in (url.username or ""):
        raise _unreadable()
    if not url.database:
        raise InputError("database: postgresql://… names no database", remedy=_FORMS)
    if _MASK in {url.password, *url.query.values()}:
        raise InputError(
            f"database: the password of postgresql://… is masked as {_MASK}",
            remedy=f"Put it there, or into {VARIABLE} or the file that PGPASSFILE names.",
        )
    return Location(url, None)


def without_secrets(text: str) -> str:
    """Mask the passwords of the server that the environment names in a text."""
    if not _LIKE_A_SERVER.match(os.environ.get(VARIABLE, "")):
        return text
    try:
        return locate(os.environ[VARIABLE]).without_secrets(text)
    except InputError:
        # It is not known where its password begins; whoever opens it is told.
        return masked(text)


def _unreadable() -> InputError:
    return InputError(
        "database: postgresql://… cannot be read as a URL",
        remedy=f"{_FORMS} Write @, / or ? in a name or a password as %40, %2F or %3F.",
    )


def _spellings(character: str) -> str:
    """Make a pattern of the ways in which a character of a secret may be written."""
    encoded = "".join(f"%{byte:02x}" for byte in character.encode("utf-8", "surrogateescape"))
    quoted = repr(character)[1:-1]
    plus = r"|\+" if character == " " else ""
    return f"(?:{re.escape(character)}|(?i:{encoded})|{re.escape(quoted)}{plus})"


def option(place: Place) -> str:
    """Write how a command names a database again, with a space before it; nothing for the default.

    A password is never in it: the variable is named if the address came from there, else the
    password is masked, and ``locate`` says what to put there.

    Raises:
        InputError: The place names no database.
    """
    if place is None or place == "":
        return ""
    location = locate(place)
    if location.path is not None:
        return f" --db {shlex.quote(str(place))}"
    masks = {name: _MASK for name in location.url.query if name not in _SHOWN}
    if not (masks or location.url.password):
        return f" --db {shlex.quote(_address(location.url))}"
    if os.environ.get(VARIABLE) == str(place):
        return f' --db "${VARIABLE}"'
    return f" --db {shlex.quote(_address(location.url.update_query_dict(masks)))}"


def _address(url: URL) -> str:
    text = url.set(drivername="postgresql").render_as_string(hide_password=True)
    return text.replace(quote_plus(_MASK), _MASK)


def masked(text: str) -> str:
    """Mask what looks like a password of a server in a text that may quote what a person typed.

    >>> masked("postgresql://me:a@b@host/db: no such file; password=a")
    'postgresql://me:*** no such file; password=***'
    >>> masked("me:a@host: column gap belongs to adeye:risk.gap@1, not to local:gap@12.")
    'me:*** column gap belongs to adeye:risk.gap@1, not to local:gap@12.'
    """
    return _TYPED.sub(lambda match: (match[1] or match[2] or match[3]) + _MASK, text)
