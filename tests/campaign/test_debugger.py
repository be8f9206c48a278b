"""A debugger in code from outside: where it begins, is refused, and that nothing is kept."""

from __future__ import annotations

import io
import sys
import threading
from typing import Any

import pytest

from adeye.campaign import debugger
from adeye.errors import Interrupted, UsageError
from adeye.simulate.channels.scalar import ScalarChannel
from adeye.supervision import guest
from adeye.testing import channel_context
from tests.refusals import refused


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a function that answers the prompt with some lines."""
    monkeypatch.setattr(debugger, "is_terminal", lambda: True)

    def answer(*lines: str) -> None:
        monkeypatch.setattr(sys, "stdin", io.StringIO("".join(f"{line}\n" for line in lines)))

    return answer


def test_debugger_begins_where_a_guest_raises_and_ends_the_campaign(
    terminal: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    terminal("p seen + 41", "q")

    def work() -> None:
        with debugger.post_mortem(), debugger.executing(), guest("mine.py:Mine", "sensor"):
            seen = 1
            raise ValueError(seen)

    refused(Interrupted, work)
    said = capsys.readouterr().out
    assert "ValueError: 1" in said
    assert "42\n" in said


def test_only_the_first_exception_is_looked_at_and_none_without_being_asked(terminal: Any) -> None:
    with pytest.raises(ValueError, match="no"), debugger.executing(), guest("mine.py:Mine"):
        raise ValueError("no")
    terminal("q")
    with pytest.raises(ValueError, match="before"), debugger.post_mortem(), guest("mine.py:Mine"):
        raise ValueError("before any block")


def test_object_of_a_run_that_raises_is_looked_at_although_it_is_contained(terminal: Any) -> None:
    def broken(_parameters: Any, _context: Any) -> Any:
        raise ValueError("no")

    channel = ScalarChannel(broken)
    terminal("q")
    with pytest.raises(Interrupted), debugger.post_mortem(), debugger.executing():
        channel.reset(channel_context({}, links=[], sensors={}))


@pytest.mark.parametrize("lines", [["p seen + 41", "c"], ["p seen + 41", "q"]])
def test_breakpoint_shows_values_and_nothing_of_its_block_is_kept(
    terminal: Any, capsys: pytest.CaptureFixture[str], lines: list[str]
) -> None:
    terminal(*lines)
    passed = []

    def work() -> None:
        with debugger.executing(), debugger.executing(), guest("mine.py:Mine"):
            seen = 1
            breakpoint()
            passed.append(seen)

    refused(Interrupted, work)
    assert "42\n" in capsys.readouterr().out
    assert passed == ([1] if lines[-1] == "c" else [])


def test_breakpoint_in_a_thread_or_without_a_terminal_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def stop() -> None:
        with debugger.executing():
            breakpoint()

    said: list[str] = []
    thread = threading.Thread(target=lambda: said.append(str(refused(UsageError, stop))))
    thread.start()
    thread.join()
    assert "adeye run --pdb" in said[0]
    monkeypatch.setattr(debugger, "is_terminal", lambda: False)
    refused(UsageError, stop, says="needs a terminal")


def test_breakpoint_outside_of_blocks_is_what_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    with debugger.executing():
        hook = sys.breakpointhook
    assert hook is not sys.__breakpointhook__
    monkeypatch.setenv("PYTHONBREAKPOINT", "0")
    assert hook() is None
