"""Who holds a lease, and whether that process still lives.

On one machine a process is known by pid, start time and boot id, because pids are used again.
Across machines only the expiry of the lease tells.
"""

from __future__ import annotations

import json
import os
import socket
import time
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

from sqlalchemy import Connection, Row, func, select

from adeye.store.catalogue import is_server
from adeye.store.texts import json_text, utc_text

_PROC = Path("/proc")


@dataclass(frozen=True)
class Owner:
    """A process that can hold a lease.

    Attributes:
        machine: Host name, boot id and pid namespace; equal only where pids can be compared.
        pid: Process id.
        started: Start time of the process in ticks since boot; empty where unknown.
    """

    machine: str
    pid: int
    started: str

    @classmethod
    def current(cls) -> Self:
        """Describe this process."""
        return cls(machine(), os.getpid(), _start_time(os.getpid()) or "")

    def to_text(self) -> str:
        """Write it as one text for the database."""
        return json_text(asdict(self))

    @property
    def is_here(self) -> bool:
        """Whether it runs where this process can see it."""
        return self.machine == machine()

    @property
    def is_dead(self) -> bool:
        """Whether it certainly no longer runs; always False for another machine."""
        if not self.is_here:
            return False
        if not _PROC.is_dir():
            return not _answers(self.pid)
        return _start_time(self.pid) != self.started


def owner_from_text(text: str) -> Owner:
    """Read what ``Owner.to_text`` wrote."""
    return Owner(**json.loads(text))


def machine() -> str:
    """Identify this boot of this machine and the pid namespace."""
    try:
        boot = (_PROC / "sys/kernel/random/boot_id").read_text("ascii").strip()
        namespace = str((_PROC / "self/ns/pid").readlink())
    except OSError:
        boot, namespace = "", ""
    return f"{socket.gethostname()} {boot} {namespace}".strip()


def boot_clock_s() -> float:
    """Seconds on a clock that all processes of one boot share and that nobody can set."""
    return time.monotonic()


def _start_time(pid: int) -> str | None:
    """Start time of a process, None if there is none or only its exit status is left."""
    try:
        text = (_PROC / str(pid) / "stat").read_text("utf-8", "replace")
    except OSError:
        return None
    # The name in parentheses may itself hold spaces and parentheses.
    fields = text.rpartition(")")[2].split()
    return None if fields[0] in {"Z", "X"} else fields[19]


def _answers(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def clock_now(connection: Connection) -> datetime:
    """Read the clock that leases go by: that of the server, if there is one."""
    if is_server(connection):
        now: datetime = connection.execute(select(func.clock_timestamp())).scalar_one()
        return now
    return datetime.now(UTC)


def is_abandoned(leased: Row[Any], now: datetime) -> bool:
    """Whether nobody holds the lease of a block any more."""
    owner = owner_from_text(leased.owner)
    if owner.is_here:
        # The clock of the boot cannot be set, so a changed time of day ends no lease.
        return owner.is_dead or boot_clock_s() >= leased.until_boot_s
    return utc_text(now) >= str(leased.until)
