"""How far a campaign is: a live line on a terminal, elsewhere one at each end and each minute."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from types import FrameType
from typing import TYPE_CHECKING, Any, Final, Protocol

from adeye.cli.output import before_writing, clean, talk
from adeye.errors import Interrupted, Terminated
from adeye.notices import told_to, watched_by
from adeye.supervision import note_end, note_signal, settle_children

if TYPE_CHECKING:
    from rich.status import Status

    from adeye.campaign.run import Stop

# --- How far a campaign is: a live line on a terminal, elsewhere one at each end and each minute --


class ProgressLike(Protocol):
    """What a campaign says about itself while it runs."""

    @property
    def done(self) -> int:
        """Test cases that have a result and verdicts."""

    @property
    def total(self) -> int:
        """Test cases planned."""

    @property
    def failures(self) -> int:
        """Runs so far in which an FSR failed."""

    @property
    def phase(self) -> str:
        """What is being done."""


Report = Callable[[ProgressLike], None]

LINE_EVERY_S: Final = 60.0
"""Between two lines where nobody watches a terminal, such as in the log of a server [s]."""
_WORDS: Final = {"wait": "wait for other runners"}
"""Phases that need more than their word."""


class Meter:
    """Rate and remaining time of a phase; what was there when it began does not count."""

    def __init__(self) -> None:
        self._phase = ""
        self._began = 0.0
        self._first = 0
        self.phases: dict[str, tuple[int, float]] = {}

    def update(self, progress: ProgressLike, now: float) -> tuple[str, str]:
        """Return rate and remaining time as people read them, empty where not known.

        Args:
            progress: The newest state.
            now: Clock [s].
        """
        if progress.phase != self._phase:
            self._phase, self._began, self._first = progress.phase, now, progress.done
        elapsed = now - self._began
        made = progress.done - self._first
        self.phases[progress.phase] = (made, elapsed)
        if made <= 0 or elapsed <= 0.0:
            return "", ""
        rate = made / elapsed
        left = max(0, progress.total - progress.done) / rate
        return f"{rate:.3g}/s", f"{duration(left)} left" if left > 0.0 else ""


def duration(seconds: float) -> str:
    """Write a duration for people.

    >>> duration(9.6), duration(75), duration(3700)
    ('10 s', '1 min 15 s', '1 h 1 min')
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def line(progress: ProgressLike, rate: str, left: str) -> str:
    """Write the state of a phase as one line: how far it is, how fast, and what failed.

    Args:
        progress: The state.
        rate: For people, or empty.
        left: Time that is left, for people, or empty.
    """
    phase = _WORDS.get(progress.phase, progress.phase)
    parts = [f"{progress.done:,}/{progress.total:,}", rate, left, _failed(progress)]
    return clean(f"{phase}: {', '.join(filter(None, parts))}")


def _failed(progress: ProgressLike) -> str:
    return f"{progress.failures:,} failed" if progress.failures else ""


def is_live() -> bool:
    """Tell whether somebody watches standard error on a terminal that can move its cursor."""
    return (
        sys.stderr is not None
        and sys.stderr.isatty()
        and os.environ.get("TERM", "") not in {"dumb", "unknown"}
        and not os.environ.get("CI")
    )


@contextmanager
def reporting(what: str, *, quiet: bool = False) -> Iterator[Report]:
    """Show progress while the block runs.

    Args:
        what: What is done, for the first and the last line.
        quiet: Show nothing.

    Yields:
        The function to call with the newest state.
    """
    if quiet:
        with told_to(_nothing), watched_by(_nothing):
            yield _nothing
    elif is_live():
        with _bar() as report:
            yield report
    else:
        meter = Meter()
        began = time.perf_counter()
        talk(f"{what} …")

        told = began

        def count(progress: ProgressLike) -> None:
            nonlocal told
            now = time.perf_counter()
            speed = meter.update(progress, now)
            if now - told >= LINE_EVERY_S:
                told = now
                talk(line(progress, *speed))

        yield count
        talk(f"{what}: done in {duration(time.perf_counter() - began)}")


def watching(*, quiet: bool = False) -> AbstractContextManager[Report]:
    """Show progress on a terminal only: for a command whose output says all when it is done.

    Args:
        quiet: Show nothing there either.
    """
    return reporting("", quiet=quiet) if quiet or is_live() else nullcontext(_nothing)


@contextmanager
def _alone() -> Iterator[None]:
    """Let nothing else move on the terminal."""
    for make_room in before_writing:
        make_room()
    with watched_by(_nothing):
        yield


def _status(what: str) -> Status:
    from rich.console import Console
    from rich.text import Text

    return Console(stderr=True).status(Text(clean(what)))


@contextmanager
def waiting(what: str, *, quiet: bool = False) -> Iterator[None]:
    """Show on a terminal what is waited for, as long as it is.

    Args:
        what: In words.
        quiet: Show nothing there either.
    """
    if quiet or not is_live():
        yield
        return
    with _alone(), _status(what):
        yield


PATIENCE_S: Final = 1.0
"""What takes less is not told [s]."""


@contextmanager
def ongoing() -> Iterator[None]:
    """Show on a terminal what is being done once that takes long; what is written ends the line."""
    if not is_live():
        yield
        return
    began = time.monotonic()
    shown: list[Status] = []

    def show(text: str) -> None:
        if shown:
            shown[0].update(clean(text))
        elif time.monotonic() - began >= PATIENCE_S:
            shown.append(_status(text))
            shown[0].start()

    def make_room() -> None:
        nonlocal began
        if shown:
            shown.pop().stop()
        began = time.monotonic()

    before_writing.append(make_room)
    try:
        with watched_by(show):
            yield
    finally:
        make_room()
        before_writing.remove(make_room)


def _nothing(_what: object) -> None:
    """Show nothing."""


@contextmanager
def _bar() -> Iterator[Report]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=30),
        TextColumn("{task.fields[count]}", markup=False),
        TextColumn("{task.fields[rate]}", markup=False),
        TextColumn("{task.fields[left]}", markup=False),
        TextColumn("{task.fields[failures]}", markup=False, style="red"),
    )
    meter = Meter()
    with (
        _alone(),
        Progress(*columns, console=Console(stderr=True), refresh_per_second=5) as live,
    ):
        task = live.add_task("starting", total=None, count="", rate="", left="", failures="")

        def show(progress: ProgressLike) -> None:
            rate, left = meter.update(progress, time.perf_counter())
            live.update(
                task,
                description=clean(_WORDS.get(progress.phase, progress.phase)),
                completed=progress.done,
                total=max(1, progress.total),
                count=f"{progress.done:,.0f}/{progress.total:,.0f}",
                rate=rate,
                left=left,
                failures=_failed(progress),
            )

        yield show


# --- Ctrl-C and SIGTERM: what is open is closed, what can be kept is kept, the exit code says why -

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
