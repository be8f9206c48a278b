"""Injectors of outages and of silence, and the draws and sizes that injectors share."""

from functools import partial
from typing import Any

import numpy as np

from adeye.kernel.random import normal, owner_id, uniform
from adeye.signals import OK, SILENT
from adeye.simulate.faults.injector import Draws, InjectorContext
from adeye.testing.sensors import injector, moment
from tests.simulate.faults.flows import command, sample
from tests.simulate.faults.streams import CONTEXT, RUNS, streams

FIRST = np.array([True, False])
NONE = np.zeros(2, dtype=np.bool_)
TARGETS = {"drop_out": "sensors.front", "silent": "channels.nominal"}


def made(model: str) -> Any:
    return injector(model, TARGETS[model], runs=2)


measurement = partial(sample, with_estimate=True)


def test_dropped_out_sensor_keeps_its_last_sample_but_shows_nothing() -> None:
    fault = made("drop_out")
    fault.apply(measurement(1.0), moment(NONE))
    given = measurement(1.1)
    given.values = np.ones((2, 4))
    faulty = fault.apply(given, moment(FIRST))
    assert faulty.alive.tolist() == [False, True]
    assert faulty.fresh.tolist() == [False, True]
    assert faulty.stamp.tolist() == [1.0, 1.1]
    assert faulty.mask.sum(axis=1).tolist() == [0, 2]
    assert faulty.source[0].tolist() == [-1, -1]
    assert faulty.estimate is not None
    assert faulty.estimate[:, 0].tolist() == [1.0, 1.1]
    assert faulty.values is not None
    assert np.isnan(faulty.values).tolist() == [[True] * 4, [False] * 4]
    assert given.alive.all()
    assert given.stamp.tolist() == [1.1, 1.1]
    assert (given.values == 1.0).all()


def test_stamp_stands_for_the_whole_drop_out_and_runs_on_after_it() -> None:
    fault = made("drop_out")
    fault.apply(measurement(1.0), moment(NONE))
    stamps = [fault.apply(measurement(1.0 + 0.1 * k), moment(FIRST)).stamp[0] for k in range(1, 4)]
    assert stamps == [1.0, 1.0, 1.0]
    after = measurement(1.5)
    assert fault.apply(after, moment(NONE)) is after
    # A sensor that is dead from the start never delivers.
    faulty = made("drop_out").apply(measurement(0.0), moment(FIRST))
    assert faulty.stamp.tolist() == [-1.0, 0.0]


def test_run_that_drops_out_later_keeps_its_own_last_sample() -> None:
    fault = made("drop_out")
    fault.apply(measurement(1.0), moment(FIRST))
    fault.apply(measurement(2.0), moment(FIRST))
    assert fault.apply(measurement(3.0), moment(~FIRST)).stamp.tolist() == [3.0, 2.0]


def test_silent_channel_says_nothing_new() -> None:
    fault = made("silent")
    fault.apply(command(1.0), moment(NONE))
    given = command(1.1)
    for _ in range(3):
        faulty = fault.apply(given, moment(FIRST))
        assert faulty.status.tolist() == [SILENT, OK]
        assert faulty.stamp.tolist() == [1.0, 1.1]
        assert faulty.acceleration.tolist() == [1.0, 1.1]
    assert given.status.tolist() == [OK, OK]
    # From the start it has no command.
    faulty = made("silent").apply(command(1.0), moment(FIRST))
    assert faulty.stamp.tolist() == [-1.0, 1.0]
    assert faulty.acceleration.tolist() == [0.0, 1.0]


OWNER = np.uint64(owner_id("fault/tested"))


def draws(owner: np.uint64 = OWNER) -> Draws:
    return Draws(InjectorContext([], CONTEXT, 0.05, owner))


def test_draw_is_named_by_seed_owner_sample_and_index() -> None:
    made = draws()
    item = streams()["truth"][0]
    item.fresh[:] = [True, False, True]
    made.count(item)
    made.count(item)
    indices = np.array([[0, 5]] * RUNS)
    for run, number in enumerate((2, 0, 2)):
        seed = CONTEXT.stream_seeds[run]
        for place, index in enumerate((0, 5)):
            assert made.uniforms(indices)[run, place] == uniform(seed, OWNER, number, index)
            assert made.normals(indices)[run, place] == normal(seed, OWNER, number, index)


def test_sample_that_is_shown_again_has_the_same_draws() -> None:
    made = draws()
    before = made.shares(3)
    item = streams()["truth"][0].copy()
    item.fresh[:] = False
    made.count(item)
    assert made.shares(3).tolist() == before.tolist()
    item.fresh[:] = True
    made.count(item)
    assert not set(made.shares(3)) & set(before)


def test_every_fault_has_its_own() -> None:
    other = np.uint64(owner_id("fault/other"))
    assert not set(draws().shares(0)) & set(draws(other).shares(0))


# --- Channels are told of the faults inside them when these come and go, and not otherwise --------


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
    for active in (NONE, NONE, FIRST, FIRST, NONE, NONE):
        assert fault.apply(channel, moment(active)) is channel
    sizes = [0.5, -1.0]
    assert channel.told == [
        ("map_shifted", [True, False], sizes),
        ("map_shifted", [False, False], sizes),
    ]


def test_model_without_a_size_has_the_size_one_and_one_that_never_comes_is_never_told() -> None:
    channel = Listener()
    fault = injector("tracks_lost", "hooks.nominal", runs=2)
    for _ in range(5):
        fault.apply(channel, moment(NONE))
    assert channel.told == []
    fault.apply(channel, moment(FIRST))
    assert channel.told == [("tracks_lost", [True, False], [1.0, 1.0])]
