"""What is told while something goes on, such as what is being waited for.

It goes through the logger ``adeye.notices``, so that whoever uses adeye from Python decides about
it as about any other log; the command line tells it on standard error.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

PATIENCE_S: Final = 3.0
"""How long something may be waited for before it is told [s]."""
AGAIN_S: Final = 10.0
"""Between two notices of one wait [s]."""

_LOG: Final = logging.getLogger("adeye.notices")
_told: Final[dict[str, float]] = {}


class _Teller(logging.Handler):
    def __init__(self, tell: Callable[[str], None]) -> None:
        super().__init__()
        self._tell = tell

    def emit(self, record: logging.LogRecord) -> None:
        self._tell(record.getMessage())


def notice(text: str, *, topic: str = "", every_s: float = 0.0) -> None:
    """Tell something.

    Args:
        text: What.
        topic: Of which it is told only now and then, whoever tells it; empty for none.
        every_s: Between two notices of the topic [s].
    """
    now = time.monotonic()
    if topic:
        if now - _told.get(topic, -every_s - 1.0) < every_s:
            return
        _told[topic] = now
    _LOG.warning("%s", text)


@contextmanager
def told_to(tell: Callable[[str], None]) -> Iterator[None]:
    """Hand over what is told while the block runs, and to nobody else.

    Args:
        tell: Called with each notice, from any thread.
    """
    before = _LOG.handlers, _LOG.propagate
    _LOG.handlers, _LOG.propagate = [_Teller(tell)], False
    try:
        yield
    finally:
        _LOG.handlers, _LOG.propagate = before


def doing(text: str) -> None:
    """Say what is being done, for whoever watches; it is said often and costs next to nothing.

    Args:
        text: What, and how far it is.
    """
    if _watchers:
        _watchers[-1](text)


_watchers: Final[list[Callable[[str], None]]] = []


@contextmanager
def watched_by(show: Callable[[str], None]) -> Iterator[None]:
    """Hand over what is being done while the block runs.

    Args:
        show: Called with each text of ``doing``, from any thread.
    """
    _watchers.append(show)
    try:
        yield
    finally:
        _watchers.pop()


@contextmanager
def waiting_for(what: str) -> Iterator[None]:
    """Tell what is waited for, if that takes long.

    Args:
        what: For people, as it follows ``waiting for``.
    """
    began = time.monotonic()

    def tell(over: threading.Event) -> None:
        pause = PATIENCE_S
        while not over.wait(pause):
            elapsed = time.monotonic() - began
            notice(f"waiting for {what}, {elapsed:.0f} s so far", topic=what, every_s=PATIENCE_S)
            pause = AGAIN_S

    with meanwhile(tell, "notices"):
        yield


@contextmanager
def meanwhile(act: Callable[[threading.Event], None], name: str) -> Iterator[None]:
    """Do something in a thread of its own while the block runs.

    Args:
        act: Told when the block is over, and ends then.
        name: Of the thread.
    """
    over = threading.Event()
    thread = threading.Thread(target=act, args=(over,), name=name, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
