"""SIGTERM as an exception, so that what is open is closed and the exit code says why."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from adeye.errors import Terminated


@contextmanager
def raising_on_sigterm() -> Iterator[None]:
    """Raise ``Terminated`` in the main thread when SIGTERM comes; elsewhere change nothing."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    former = signal.signal(signal.SIGTERM, _raise)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, former)


def _raise(_signal: int, _frame: FrameType | None) -> None:
    raise Terminated
