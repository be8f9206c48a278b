"""A process that has everything imported and compiled, and forks runners that end badly.

It reads one request per line, as JSON: ``{"arguments": […], "folder": …, "output": …, "setup":
{…}}`` forks a child that runs ``adeye`` with these arguments as the console script does, and is
answered with its process id; ``{"wait": pid}`` is answered with its status. What ``setup`` asks for
is put in place in the child only:

- ``block``: test cases in one block of work.
- ``fsize``: the size in bytes that no file may exceed, as on a full disk.
- ``calls``: a file in which the child counts what it asks of the database, or, with ``fail``, of
  whatever fails.
- ``calls_of``: the method of the repository that is counted instead, and with which answer;
  ``pause_s``: how long each call of it waits.
- ``zone``, ``moment``: the time zone of the machine, and the time in UTC at which the child starts.
- ``fail``: which kind of call fails (``database``, ``file``, ``process`` or ``pipe``), and when.
- ``timed``: a file for the seconds that the child waits for the database; then nothing is counted.
- ``late``: every lease ends at once.
- ``lease_s``: how long leases are, and how long a server waits for a transaction that stands still.
- ``clock_s``: seconds by which its wall clock is wrong; ``machine``: another name of the machine.
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import sys
import time
import traceback
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any, Final

from tests.chaos import failing

LOADED: Final = (
    "adeye.api",
    "adeye.campaign.plan",
    "adeye.campaign.run",
    "adeye.cli.app",
    "adeye.cli.progress",
    "adeye.report.page.html",
    "adeye.reporting",
    "adeye.store.read.query",
    "adeye.store.repository",
)
"""What a verb imports when it is asked for it; here once for all children."""


def serve() -> None:
    """Fork children as they are asked for, until the pipe closes."""
    for name in LOADED:
        importlib.import_module(name)
    for line in sys.stdin:
        request = json.loads(line)
        if "wait" in request:
            _, status = os.waitpid(request["wait"], 0)
            answer = os.waitstatus_to_exitcode(status)
        elif request.get("here"):
            answer = _verb(request)
        else:
            answer = os.fork()
            if answer == 0:
                _child(request)
        sys.stdout.write(f"{answer}\n")
        sys.stdout.flush()


def _child(request: Mapping[str, Any]) -> None:
    os.setsid()
    code = 70
    try:
        code = _verb(request)
    except BaseException:  # noqa: BLE001 - a child must never return into the loop
        traceback.print_exc()
    finally:
        os._exit(code)


def _verb(request: Mapping[str, Any]) -> int:
    """Run a verb with its output in a file."""
    from adeye.cli.app import main

    os.chdir(request["folder"])
    kept = [os.dup(number) for number in (0, 1, 2)]
    with open(request["output"], "wb") as output, open(os.devnull, "rb") as nothing:  # noqa: PTH123
        for number, file in enumerate((nothing, output, output)):
            os.dup2(file.fileno(), number)
    _put_in_place(request.get("setup", {}))
    code = main(request["arguments"])
    sys.stdout.flush()
    sys.stderr.flush()
    for number, copy in enumerate(kept):
        os.dup2(copy, number)
        os.close(copy)
    return code


def _put_in_place(setup: Mapping[str, Any]) -> None:
    from adeye.campaign import run as runner
    from adeye.store import owner, postgres

    if "block" in setup:
        runner.block_size = lambda _: setup["block"]  # type: ignore[assignment]
    if "fsize" in setup:
        _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (setup["fsize"], hard))
    if "zone" in setup:
        os.environ["TZ"] = setup["zone"]
        time.tzset()
        moment = datetime.fromisoformat(setup["moment"]).replace(tzinfo=UTC)
        failing.move_clock((moment - datetime.now(UTC)).total_seconds())
    if "clock_s" in setup:
        failing.move_clock(setup["clock_s"])
    if "machine" in setup:
        owner.machine = lambda: setup["machine"]
    if "lease_s" in setup:
        runner.LEASE_S = setup["lease_s"]  # type: ignore[misc]
        postgres.STALL_S = setup["lease_s"]  # type: ignore[misc]
    if "late" in setup:
        # Every lease ends at once, so each runner takes over whatever the other one holds.
        runner.LEASE_S = -1.0  # type: ignore[misc]
    _count(setup)


def _count(setup: Mapping[str, Any]) -> None:
    if "calls_of" in setup:
        pause_s = setup.get("pause_s", 0.0)
        failing.count_method(setup["calls"], *setup["calls_of"], pause_s=pause_s)
    elif "timed" in setup:
        failing.time_database(setup["timed"])
    elif "calls" in setup:
        failing.count(setup["calls"], **setup.get("fail", {}))


if __name__ == "__main__":
    serve()
