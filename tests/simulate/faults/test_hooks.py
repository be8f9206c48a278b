"""Channels are told of the faults inside them when these come and go, and not otherwise."""

from __future__ import annotations

from typing import Any

import numpy as np

from adeye.testing.sensors import injector, moment

OFF = np.array([False, False])
FIRST = np.array([True, False])


class Listener:
    """Writes down what it is told."""

    hooks = ("map_shifted", "tracks_lost")

    def __init__(self) -> None:
        self.told: list[tuple[str, list[bool], list[float]]] = []

    def inject(self, hook: str, active: Any, size: Any) -> None:
        self.told.append((hook, active.tolist(), size.tolist()))


def test_channel_hears_of_every_change_and_of_nothing_else() -> None:
    offsets: list[dict[str, Any]] = [{"offset": "0.5 m"}, {"offset": "-1 m"}]
    fault = injector("map_shifted", "hooks.nominal", runs=2, parameters=offsets)
    channel = Listener()
    for active in (OFF, OFF, FIRST, FIRST, OFF, OFF):
        assert fault.apply(channel, moment(active)) is channel
    sizes = [0.5, -1.0]
    assert channel.told == [
        ("map_shifted", [True, False], sizes),
        ("map_shifted", [False, False], sizes),
    ]


def test_model_without_a_size_has_the_size_one() -> None:
    channel = Listener()
    injector("tracks_lost", "hooks.nominal", runs=2).apply(channel, moment(FIRST))
    assert channel.told == [("tracks_lost", [True, False], [1.0, 1.0])]


def test_fault_that_never_comes_is_never_told() -> None:
    channel = Listener()
    fault = injector("tracks_lost", "hooks.nominal", runs=2)
    for _ in range(5):
        fault.apply(channel, moment(OFF))
    assert channel.told == []
