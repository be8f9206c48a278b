"""Ctrl-C and SIGTERM: what is open is closed, what can be kept is kept, the exit code says why."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any, Final

from adeye.cli.output import talk
from adeye.errors import Interrupted, Terminated
from adeye.supervision import note_end, note_signal, settle_children

if TYPE_CHECKING:
    from adeye.campaign.stopping import Stop

GRACE_S: Final = 5.0
"""How long blocks that are being executed may take to end after the first signal [s]."""

_DEFAULT: Final = signal.SIG_DFL
_KINDS: Final[dict[int, type[BaseException]]] = {
    signal.SIGINT: Interrupted,
    signal.SIGTERM: Terminated,
}


_own: list[Any] = []
"""Handlers that are ours."""


def _heed() -> None:
    """Let the child of a plug-in end when it is told to: what it inherits is meant for us."""
    for name, usual in ((signal.SIGINT, signal.default_int_handler), (signal.SIGTERM, _DEFAULT)):
        if signal.getsignal(name) in _own:
            signal.signal(name, usual)


settle_children(_heed)


@contextmanager
def raising_on_sigterm() -> Iterator[None]:
    """Raise what they mean in the main thread when SIGINT and SIGTERM come; else change nothing.

    Compiled code that they come in may make another error of it, which then stands for them.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    asked: list[type[BaseException]] = []

    def end(number: int, _frame: FrameType | None) -> None:
        note_signal(number)
        asked.append(_KINDS[number])
        raise _KINDS[number]

    _own.append(end)
    former = {signal.SIGTERM: signal.signal(signal.SIGTERM, end)}
    # Where it is ignored, as in the background of a shell, or somebody else listens, it stays so.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        former[signal.SIGINT] = signal.signal(signal.SIGINT, end)
    try:
        yield
    except Exception as error:
        if asked:
            raise asked[0] from error
        raise
    finally:
        for name, handler in former.items():
            signal.signal(name, handler)
        _own.remove(end)


@contextmanager
def asking(stop: Stop, hint: str) -> Iterator[None]:
    """Let the first Ctrl-C or SIGTERM ask for the end, and the second one be the end.

    After the first one a campaign completes the blocks that are being executed, if they end within
    ``GRACE_S``. The second one kills the workers and this process. The database stays as it is:
    what is not committed is rolled back, and whoever runs the campaign next takes over the rest.

    Args:
        stop: Who is asked.
        hint: What is said before the second one ends everything: how to go on.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def ask(number: int, _frame: FrameType | None) -> None:
        note_signal(number)
        if stop.asked is not None:
            _end(number, hint)
        if stop.is_deferred:
            talk(
                f"Interrupted: what is being executed gets {GRACE_S:g} s to end; "
                "once more ends it at once."
            )
            signal.setitimer(signal.ITIMER_REAL, GRACE_S)
        stop.ask(_KINDS[number])

    def expire(_number: int, _frame: FrameType | None) -> None:
        if stop.is_deferred:
            stop.check()

    _own.append(ask)
    handlers = {signal.SIGINT: ask, signal.SIGTERM: ask, signal.SIGALRM: expire}
    former = {name: signal.signal(name, handler) for name, handler in handlers.items()}
    try:
        yield
    finally:
        if stop.asked is not None:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        for name, handler in former.items():
            signal.signal(name, handler)
        _own.remove(ask)


def _end(number: int, hint: str) -> None:
    """End this process and its workers now."""
    from adeye.campaign.executors import kill_workers

    kill_workers()
    talk(hint)
    sys.stderr.flush()
    note_end(128 + number)
    os._exit(128 + number)


def leave_if_abandoned(code: int) -> None:
    """End the process here where a thread executes a block that nobody waits for any more.

    Python would wait for it at its end.
    """
    executors = sys.modules.get("adeye.campaign.executors")
    if executors is not None and executors.is_abandoned_work_running():
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
