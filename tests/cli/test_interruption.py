"""Signals become exceptions, wishes, and at last the end."""

import signal
import threading
import time

import pytest

from adeye.campaign import executors
from adeye.campaign.run import Stop
from adeye.cli import progress as interruption
from adeye.cli.progress import asking, leave_if_abandoned, raising_on_sigterm
from adeye.errors import Terminated


def test_sigterm_raises_inside_and_the_former_handler_comes_back() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(Terminated), raising_on_sigterm():
        signal.raise_signal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) == before


def test_what_compiled_code_makes_of_it_stands_for_it() -> None:
    class Named:
        def __set_name__(self, _owner: object, _name: str) -> None:
            signal.raise_signal(signal.SIGTERM)

    def make() -> None:
        type("Owner", (), {"part": Named()})

    with pytest.raises(Terminated) as caught, raising_on_sigterm():
        make()
    assert isinstance(caught.value.__cause__, RuntimeError)
    with pytest.raises(RuntimeError, match="its own"), raising_on_sigterm():
        raise RuntimeError("its own")


def test_another_thread_leaves_the_handler_alone() -> None:
    before = signal.getsignal(signal.SIGTERM)
    seen: list[object] = []

    def look() -> None:
        with raising_on_sigterm():
            seen.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert seen == [before]


class Ended(BaseException):
    """Stands for the end of the process."""


@pytest.fixture
def ends(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Note the exit code of a process that would have ended."""
    codes: list[int] = []

    def end(code: int) -> None:
        codes.append(code)
        raise Ended

    monkeypatch.setattr("adeye.cli.progress.os._exit", end)
    return codes


@pytest.mark.parametrize(
    ("name", "kind"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)]
)
def test_outside_of_blocks_the_first_signal_interrupts(
    name: signal.Signals, kind: type[BaseException]
) -> None:
    before = signal.getsignal(name)
    with pytest.raises(kind), asking(Stop(), "go on"):
        signal.raise_signal(name)
    assert signal.getsignal(name) == before


def test_inside_of_blocks_the_first_signal_is_a_wish(capsys: pytest.CaptureFixture[str]) -> None:
    stop, went_on = Stop(is_deferred=True), []
    with asking(stop, "go on"):
        signal.raise_signal(signal.SIGTERM)
        went_on.append(signal.getitimer(signal.ITIMER_REAL)[0])
    assert stop.asked is Terminated
    assert 0.0 < went_on[0] <= interruption.GRACE_S
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0
    assert "gets 5 s to end" in capsys.readouterr().err


def test_blocks_that_do_not_end_in_time_are_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interruption, "GRACE_S", 0.05)
    stop = Stop(is_deferred=True)

    def execute() -> None:
        with asking(stop, "go on"):
            signal.raise_signal(signal.SIGINT)
            while True:
                time.sleep(0.01)

    with pytest.raises(KeyboardInterrupt):
        execute()


def test_second_signal_kills_the_workers_and_ends(
    monkeypatch: pytest.MonkeyPatch, ends: list[int], capsys: pytest.CaptureFixture[str]
) -> None:
    killed: list[bool] = []
    monkeypatch.setattr(executors, "kill_workers", lambda: killed.append(True))
    stop = Stop(is_deferred=True)

    def execute() -> None:
        with asking(stop, "go on with this"):
            signal.raise_signal(signal.SIGTERM)
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(Ended):
        execute()
    assert (ends, killed) == ([130], [True])
    assert "go on with this" in capsys.readouterr().err


@pytest.mark.parametrize("is_running", [False, True])
def test_process_ends_at_once_only_where_a_block_would_be_waited_for(
    monkeypatch: pytest.MonkeyPatch,
    ends: list[int],
    is_running: bool,  # noqa: FBT001 - a table
) -> None:
    monkeypatch.setattr(executors, "is_abandoned_work_running", lambda: is_running)
    if is_running:
        with pytest.raises(Ended):
            leave_if_abandoned(143)
    else:
        leave_if_abandoned(143)
    assert ends == [143] * is_running
