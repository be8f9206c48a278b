"""A debugger in code from outside: where it may begin, and that what it looked into is no evidence.

Somebody at its prompt may change any value, so nothing of a block in which it began is kept: the
campaign ends there, as by Ctrl-C, and executes the block again the next time.
"""

from __future__ import annotations

import bdb
import multiprocessing
import pdb
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any, Final

from adeye import supervision
from adeye.errors import Interrupted, UsageError
from adeye.notices import notice
from adeye.supervision import unsealed


class _Here(threading.local):
    """What this thread does.

    Attributes:
        is_executing: Whether it executes a block.
        has_looked: Whether a debugger began in that block.
    """

    is_executing = False
    has_looked = False


_here: Final = _Here()


class _Debugger(pdb.Pdb):
    """Leaves the campaign where it is left, and reads what a sealed part may not."""

    def __init__(self) -> None:
        # Ctrl-C is the command line's.
        super().__init__(nosigint=True, readrc=False)
        _here.has_looked = True

    def trace_dispatch(self, frame: Any, event: str, arg: Any) -> Any:
        try:
            return super().trace_dispatch(frame, event, arg)
        except bdb.BdbQuit:
            raise Interrupted from None

    def interaction(self, frame: Any, traceback: Any) -> None:
        with unsealed():
            super().interaction(frame, traceback)


@contextmanager
def executing() -> Iterator[None]:
    """Execute a block; ``breakpoint()`` in it begins the debugger, or says why it cannot.

    Raises:
        Interrupted: A debugger began in it.
    """
    if _here.is_executing:
        # What drives runs is a part of what judges them, too.
        yield
        return
    _listen()
    _here.is_executing, _here.has_looked = True, False
    try:
        yield
    finally:
        _here.is_executing = False
    if _here.has_looked:
        raise Interrupted


@cache
def _listen() -> None:
    """Answer ``breakpoint()`` from now on; outside of blocks it is what it was."""
    former: Callable[..., Any] = sys.breakpointhook

    def begin(*arguments: Any, **words: Any) -> Any:
        if not _here.is_executing:
            return former(*arguments, **words)
        refusal = _refusal()
        if refusal is not None:
            notice(str(refusal), topic="breakpoint()", every_s=60.0)
            raise refusal
        return _Debugger().set_trace(sys._getframe().f_back)

    sys.breakpointhook = begin


def is_terminal() -> bool:
    """Tell whether somebody can answer a prompt of this process."""
    return sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty()


def _refusal() -> UsageError | None:
    """Say why no debugger can begin here; None if one can."""
    is_worker = multiprocessing.parent_process() is not None
    if is_worker or threading.current_thread() is not threading.main_thread():
        return UsageError(
            "breakpoint() has no terminal in a worker or a thread",
            remedy="Run it with 'adeye run --pdb', which executes everything in one process.",
        )
    if not is_terminal():
        return UsageError(
            "breakpoint() needs a terminal", remedy="Take it out, or start adeye in one."
        )
    return None


@contextmanager
def post_mortem() -> Iterator[None]:
    """Begin a debugger where code from outside raises first; the campaign ends after it."""

    def look(error: BaseException) -> None:
        if not _here.is_executing or _here.has_looked:
            return
        print(supervision.told(error))  # noqa: T201 - the debugger prints, too
        debugger = _Debugger()
        debugger.reset()
        debugger.interaction(None, error.__traceback__)
        raise Interrupted

    supervision.watch(look)
    try:
        yield
    finally:
        supervision.watch(None)
