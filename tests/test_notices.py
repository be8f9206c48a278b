"""What is told while something goes on."""

from collections.abc import Iterator
from threading import Event

import pytest

from adeye import notices
from adeye.errors import LostConnection
from adeye.notices import notice, told_to, waiting_for
from adeye.store import database
from adeye.store.database import persistently


@pytest.fixture
def told() -> Iterator[list[str]]:
    notices._told.clear()
    found: list[str] = []
    with told_to(found.append):
        yield found


def test_long_wait_is_told_while_it_lasts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notices, "PATIENCE_S", 0.01)
    was_told = Event()
    found: list[str] = []

    def tell(text: str) -> None:
        found.append(text)
        was_told.set()

    with told_to(tell), waiting_for("the server to answer"):
        assert was_told.wait(30.0)
    assert found[0].startswith("waiting for the server to answer, 0 s so far")


def test_short_wait_is_not_told(told: list[str]) -> None:
    with waiting_for("the server to answer"):
        pass
    assert told == []


def test_topic_is_told_now_and_then(told: list[str]) -> None:
    for text in ("first", "second"):
        notice(text, topic="one", every_s=60.0)
    notice("other", topic="other", every_s=60.0)
    assert told == ["first", "other"]


def test_lost_connection_is_told_once_it_lasts(
    told: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(database, "_FIRST_PAUSE_S", 0.01)
    monkeypatch.setattr(database, "_TOLD_FROM_S", 0.015)
    tries = 4

    def action() -> str:
        nonlocal tries
        tries -= 1
        if tries:
            raise LostConnection("the server is away.")
        return "done"

    assert persistently(action) == "done"
    assert len(told) == 1
    assert told[0].startswith("the server is away. Trying again, for 30 s at most")
