"""Connections and transactions of a database, and its errors in words.

One transaction per ``read`` or ``write``; ``write`` is alone, so that what it reads cannot change
before it writes. Readers never wait for a writer, neither on SQLite in WAL mode nor on PostgreSQL.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from typing import Any, Concatenate, Final, Generic, ParamSpec, TypeVar

from sqlalchemy import Connection, Engine

from adeye.errors import LostConnection, PlatformError
from adeye.notices import AGAIN_S, notice, waiting_for
from adeye.store.location import Location, Place, locate
from adeye.supervision import hide

WRITES: Final = "adeye_writes"
"""Execution option of a connection: that its transaction writes."""
RECONNECT_S: Final = 30.0
"""Longest time for which a lost connection is tried again [s]."""
_FIRST_PAUSE_S: Final = 0.05
_LONGEST_PAUSE_S: Final = 2.0
_TOLD_FROM_S: Final = 0.5
"""Pause from which on it is told that a connection is tried again [s]."""

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
Other = TypeVar("Other", bound="Door", covariant=True)


@contextmanager
def errors_in_words(location: Location) -> Iterator[None]:
    """Translate what the driver raises.

    Raises:
        PlatformError: The database cannot be used here and now.
        IntegrityError: Its content contradicts itself.
    """
    with _kind(location).errors_in_words(location):
        yield


class Database:
    """One database.

    May be shared between threads: each uses its own connection. After a fork the child opens its
    own connections. Nothing is held between transactions.
    """

    def __init__(self, place: Place, *, is_read_only: bool = False) -> None:
        """Prepare for a database that need not exist yet, unless it is only read.

        Args:
            place: The database.
            is_read_only: Whether nothing is ever written, not even what a damaged or foreign file
                would make SQLite write.
        """
        self.location = locate(place)
        if self.location.secrets:
            # Guests may quote the environment, or what the program was called with.
            hide(self.location.without_secrets)
        kind = _kind(self.location)
        # A server checks by itself who may write; there, what is only read is read by us only.
        reader = getattr(kind, "make_reader", kind.make_engine)
        make = reader if is_read_only else kind.make_engine
        self._engine: Engine = make(self.location, WRITES)
        self._pid = os.getpid()

    @contextmanager
    def read(self) -> Iterator[Connection]:
        """Give a connection that sees one state of the database throughout.

        Raises:
            PlatformError: A file that nobody seemed to write, and is read without locks, changed.
        """
        before = self._still_state()
        with errors_in_words(self.location), self._connect() as connection:
            yield connection
        if before is not None and self._still_state() != before:
            raise PlatformError(
                f"database {self.location} was written while it was read. Run again."
            )

    def _still_state(self) -> tuple[int, ...] | None:
        path = self.location.path
        if path is None or not path.exists():
            return None
        from adeye.store.sqlite import still_state

        return still_state(path)

    @contextmanager
    def write(self, *, shared: bool = False) -> Iterator[Connection]:
        """Give a connection that writes; commit at the end, roll back on any error.

        Args:
            shared: Others may write meanwhile, where the database has locks for rows: enough for
                what changes rows of ``work`` only, each by compare and set.
        """
        # Whoever only reads needs none of what hashes rows.
        from adeye.store import ledger

        with errors_in_words(self.location), self._connect() as connection:
            connection.execution_options(**{WRITES: "shared" if shared else "alone"})
            ledger.begin(connection)
            with waiting_for(f"other writers of database {self.location}"):
                transaction = connection.begin()
            with transaction:
                yield connection
                ledger.close(connection)

    def change(self, change: Callable[[Connection], Result], *, shared: bool = False) -> Result:
        """Write, and write again where the connection to the server was lost.

        Args:
            change: What may be done twice: if it did come through, it finds that it did.
            shared: See ``write``.
        """

        def once() -> Result:
            with self.write(shared=shared) as connection:
                return change(connection)

        return persistently(once)

    def reopen(self) -> None:
        """Go on with what is at the place of the database by now, whatever was open before.

        Code of others may have removed the file, or have closed it and opened another one under
        its number: what is open would still look as it should.

        Raises:
            PlatformError: Nothing is there any more.
        """
        self.close()
        path = self.location.path
        if path is not None and not path.is_file():
            raise PlatformError(
                f"database {self.location} is gone: it was removed while it was written. Restore "
                "it from a copy, or run again."
            )

    def close(self) -> None:
        """Close all connections of this process."""
        self._engine.dispose()

    def _connect(self) -> Connection:
        if os.getpid() != self._pid:
            # Connections of the parent must not be used, nor closed, by its child.
            self._engine.dispose(close=False)
            self._pid = os.getpid()
        if not self.location.is_server:
            return self._engine.connect()
        with waiting_for(f"the server of database {self.location} to answer"):
            return self._engine.connect()


class Door:
    """What reads and changes an open database of the current schema, a transaction a method."""

    def __init__(self, database: Database) -> None:
        """Use a database."""
        self._database = database

    def _ask(self, query: str, *values: str | int) -> Sequence[Any]:
        """Return all rows of a query, in a transaction of its own."""
        with self._database.read() as connection:
            return connection.exec_driver_sql(query, values).all()


class Part(Generic[Other]):
    """Another door to the same database, as an attribute of a door."""

    def __init__(self, kind: type[Other]) -> None:
        """Open doors of a kind."""
        self._kind = kind

    def __get__(self, own: Door, _: type[Door]) -> Other:
        """Open the door."""
        return self._kind(own._database)


def reading(
    ask: Callable[Concatenate[Connection, Arguments], Result],
) -> Callable[Concatenate[Door, Arguments], Result]:
    """Make a method that asks in a transaction of its own."""

    @wraps(ask)
    def method(own: Door, /, *values: Arguments.args, **named: Arguments.kwargs) -> Result:
        with own._database.read() as connection:
            return ask(connection, *values, **named)

    return method


def writing(
    change: Callable[Concatenate[Connection, Arguments], Result],
) -> Callable[Concatenate[Door, Arguments], Result]:
    """Make a method that changes something in a transaction of its own, alone."""

    @wraps(change)
    def method(own: Door, /, *values: Arguments.args, **named: Arguments.kwargs) -> Result:
        with own._database.write() as connection:
            return change(connection, *values, **named)

    return method


def sharing(
    change: Callable[Concatenate[Connection, Arguments], Result], *, shared: bool = True
) -> Callable[Concatenate[Door, Arguments], Result]:
    """Make a method that changes something of the queue, see ``Database.change``."""

    @wraps(change)
    def method(own: Door, /, *values: Arguments.args, **named: Arguments.kwargs) -> Result:
        return own._database.change(
            lambda connection: change(connection, *values, **named), shared=shared
        )

    return method


def persistently(action: Callable[[], Result]) -> Result:
    """Do something again for a while whenever the connection to the server is lost."""
    began = time.monotonic()
    pause = _FIRST_PAUSE_S
    while True:
        try:
            return action()
        except LostConnection as error:
            elapsed = time.monotonic() - began
            if elapsed + pause > RECONNECT_S:
                raise
            # A deadlock, or a server that restarts at once, is over before anybody needs to know.
            if pause > _TOLD_FROM_S:
                notice(
                    f"{error} Trying again, for {RECONNECT_S:g} s at most; {elapsed:.0f} s so far",
                    topic="lost connection",
                    every_s=AGAIN_S,
                )
        time.sleep(pause)
        pause = min(2.0 * pause, _LONGEST_PAUSE_S)


def create_parent(location: Location) -> None:
    """Make the folder of a database that is a file.

    Raises:
        PlatformError: The folder cannot be made.
    """
    if location.path is None:
        return
    try:
        location.path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise PlatformError(
            f"database {location}: its folder cannot be made ({error.strerror}). "
            "Choose another place with --db."
        ) from error


def _kind(location: Location) -> Any:
    if location.is_server:
        from adeye.store import postgres

        return postgres
    from adeye.store import sqlite

    return sqlite
