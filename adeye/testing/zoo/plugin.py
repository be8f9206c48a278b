"""The zoo as plug-ins: channels in Python that misbehave as they are told.

``One`` is one object per run, ``Herd`` works on the batch. ``animal`` says which one it is,
``from_tick`` since when; before, and if no animal is named, it keeps its speed.
"""

import asyncio
import contextlib
import functools
import multiprocessing
import os
import random  # noqa: TID251 - an animal seeds it
import sys
import threading
import time
import warnings
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from adeye import ports

KEPT: Final[list[Any]] = []
CALM: Final = (0.1, 0.0)


class _Unspeakable(RuntimeError):  # noqa: N818 - an error of somebody else
    def __str__(self) -> str:
        raise RuntimeError


class _Unshowable(float):
    def __repr__(self) -> str:
        raise RuntimeError


class _Endless(tuple[float, ...]):
    __slots__ = ()

    def __len__(self) -> int:
        return 10**9


def _raise(error: BaseException) -> Any:
    raise error


def _recurse(depth: int = 0) -> Any:
    return _recurse(depth + 1)


def _mutate(array: Any) -> Any:
    array[...] = 0.0
    return CALM


def _take_over(seen: Any) -> Any:
    seen.time = 0.0
    return CALM


def _forget(seen: Any) -> Any:
    seen.measurements.clear()
    return CALM


def _force(array: Any) -> Any:
    with contextlib.suppress(ValueError):
        array.flags.writeable = True
    array[...] = 1e9
    return CALM


def _print(text: str) -> Any:
    print(text)  # noqa: T201 - that is the mischief
    os.write(1, text.encode())
    return CALM


def _close(*streams: Any) -> Any:
    for stream in streams:
        stream.close()
    return CALM


def _warn() -> Any:
    warnings.simplefilter("error")
    return CALM


def _strict_numpy() -> Any:
    np.seterr(all="raise")
    return CALM


def _seed() -> Any:
    random.seed(1)
    np.random.seed(1)  # noqa: NPY002, TID251
    return CALM


def _thread() -> Any:
    def fail() -> None:
        with contextlib.suppress(RuntimeError):
            _raise(RuntimeError("in a thread"))

    thread = threading.Thread(target=fail, daemon=True)
    thread.start()
    thread.join()
    return CALM


@functools.cache
def _child(work: Callable[[Any], Any], *_: int) -> tuple[Any, Any]:
    """Start a process that shares what this one has, as a solver or a model server may be."""
    here, there = multiprocessing.Pipe()

    def start() -> None:
        here.close()
        work(there)

    child: Any = multiprocessing.get_context("fork").Process(target=start, daemon=True)
    child.start()
    there.close()
    return child, here


def _serve(end: Any) -> None:
    with contextlib.suppress(EOFError):
        while end.recv():
            end.send(CALM)


def _sleep(_: Any) -> None:
    time.sleep(20.0)


def _ask_a_child() -> Any:
    _, server = _child(_serve, os.getpid(), threading.get_ident())
    server.send(b"what now?")
    return server.recv()


def _leave_a_child() -> Any:
    _child(_sleep, os.getpid())
    return CALM


def _end_a_child() -> Any:
    child, _ = _child(_sleep, os.getpid(), 1)
    child.terminate()
    child.join()
    return CALM


def _later(array: Any) -> Any:
    """Keep what was shown and write into it at the next tick."""
    for kept in KEPT:
        with contextlib.suppress(ValueError):
            kept.flags.writeable = True
            kept[...] = -1e9
    KEPT[:] = [array]
    return CALM


ONE: Final[dict[str, Callable[[Any], Any]]] = {
    "raises": lambda _: _raise(RuntimeError("no track")),
    "leaves": lambda _: sys.exit(0),
    "is_cancelled": lambda _: _raise(asyncio.CancelledError()),
    "ends_a_generator": lambda _: _raise(GeneratorExit()),
    "stops_an_iteration": lambda _: _raise(StopIteration()),
    "recurses": lambda _: _recurse(),
    "asserts": lambda _: _raise(AssertionError()),
    "runs_out_of_memory": lambda _: _raise(MemoryError()),
    "raises_a_huge_text": lambda _: _raise(RuntimeError("x" * 10**7)),
    "raises_what_no_text_is": lambda _: _raise(RuntimeError("\ud800\x00\x1b[31m")),
    "raises_what_cannot_be_said": lambda _: _raise(_Unspeakable()),
    "returns_nothing": lambda _: None,
    "returns_one_number": lambda _: 0.1,
    "returns_three_numbers": lambda _: (0.1, 0.0, 0.0),
    "returns_a_text": lambda _: "go",
    "returns_texts": lambda _: ("0.1", "0"),
    "returns_nan": lambda _: (float("nan"), 0.0),
    "returns_infinity": lambda _: (0.0, float("inf")),
    "returns_a_huge_integer": lambda _: (10**400, 0),
    "returns_truth_values": lambda _: (True, False),
    "returns_complex_numbers": lambda _: (0.1 + 0j, 0.0),
    "returns_nested_lists": lambda _: ([0.1], [0.0]),
    "returns_an_endless_tuple": lambda _: _Endless(CALM),
    "returns_what_cannot_be_shown": lambda _: (_Unshowable("nan"), 0.0),
    "returns_an_unknown_status": lambda _: ports.ScalarCommand(0.1, 0.0, 99),
    "returns_a_status_in_words": lambda _: ports.ScalarCommand(0.1, 0.0, "ok"),  # type: ignore[arg-type]
    "returns_too_much": lambda _: (-1e6, 50.0),
    "writes_into_its_estimate": lambda seen: _mutate(seen.measurements["localisation"].estimate),
    "writes_into_it_later": lambda seen: _later(seen.measurements["localisation"].estimate),
    "writes_into_detections": lambda seen: _force(seen.measurements["front_camera"].detections),
    "takes_over_its_observation": _take_over,
    "forgets_its_links": _forget,
    "prints": lambda _: _print("brake!\n" * 100),
    "closes_its_streams": lambda _: _close(sys.stdin, sys.stdout),
    "turns_warnings_into_errors": lambda _: _warn(),
    "turns_numpy_strict": lambda _: _strict_numpy(),
    "seeds_what_is_global": lambda _: _seed(),
    "starts_a_thread": lambda _: _thread(),
    "asks_a_child": lambda _: _ask_a_child(),
    "leaves_a_child_that_sleeps": lambda _: _leave_a_child(),
    "ends_a_child": lambda _: _end_a_child(),
}
"""Answers of one object, by animal."""


class Options(ports.Parameters):
    """Which animal it is, and since which observation."""

    animal: str = ""
    from_tick: int = 5


class One:
    """One object per run."""

    Parameters = Options

    def __init__(self, parameters: Any, _context: Any) -> None:
        """Fail at once, or be ready."""
        self._name, self._left = parameters.animal, parameters.from_tick
        if self._name == "fails_at_once":
            _raise(RuntimeError("no licence"))
        if self._name == "leaves_at_once":
            sys.exit(3)

    def act(self, observation: Any) -> Any:
        """Answer as the animal does, from its tick on."""
        self._left -= 1
        if self._left < 0 and self._name in ONE:
            return ONE[self._name](observation)
        return CALM


Arrays = dict[str, Any]


def _with(**changes: Any) -> Callable[[Any, Arrays], Arrays]:
    return lambda _seen, arrays: {**arrays, **changes}


def _altered(name: str, alter: Callable[[Any], Any]) -> Callable[[Any, Arrays], Arrays]:
    return lambda _seen, arrays: {**arrays, name: alter(arrays[name])}


HERD: Final[dict[str, Callable[[Any, Arrays], Arrays]]] = {
    "raises": lambda _seen, _: _raise(RuntimeError("no track")),
    "leaves": lambda _seen, _: sys.exit(0),
    "is_cancelled": lambda _seen, _: _raise(asyncio.CancelledError()),
    "returns_nothing": lambda _seen, _: {},
    "returns_lists": _with(acceleration=[0.1]),
    "returns_none_for_a_status": _with(status=None),
    "returns_too_few_runs": lambda _seen, arrays: {
        name: value[:-1] if name != "channel" else value for name, value in arrays.items()
    },
    "returns_columns": _altered("acceleration", lambda array: array[:, np.newaxis]),
    "returns_texts": _altered("steering_angle", lambda array: array.astype(str)),
    "returns_objects": _altered("steering_angle", lambda array: array.astype(object)),
    "returns_a_status_in_parts": _altered("status", lambda array: array + 0.5),
    "returns_nan": _altered("acceleration", lambda array: array * np.nan),
    "returns_an_unknown_status": _altered("status", lambda array: array + 99),
    "returns_too_much": _altered("acceleration", lambda array: array - 1e6),
    "returns_half_floats": _altered("acceleration", lambda array: array.astype(np.float16)),
    "answers_the_future": _altered("stamp", lambda array: array + 100.0),
    "answers_for_another_channel": _with(channel="nominal"),
    "claims_monitors": _with(monitors=np.ones((1, 1, 2), dtype=np.bool_)),
    "returns_a_ragged_plan": _with(plan=np.zeros((1, 3))),
    "writes_into_its_estimate": lambda seen, arrays: (
        _mutate(seen.measurements["localisation"].estimate) and arrays
    ),
    "writes_into_it_by_force": lambda seen, arrays: (
        _force(seen.measurements["localisation"].estimate) and arrays
    ),
    "ends_the_runs": lambda seen, arrays: _force(seen.running) and arrays,
    "writes_into_the_command_of_another": lambda seen, arrays: (
        _force(seen.commands["nominal"].acceleration) and arrays
    ),
    "writes_into_its_answer_later": lambda _seen, arrays: (
        _later(arrays["acceleration"]) and arrays
    ),
    "returns_one_array_for_all": lambda _seen, arrays: {
        **arrays, "steering_angle": arrays["acceleration"], "stamp": arrays["acceleration"]
    },
    "prints": lambda _seen, arrays: _print("brake!\n") and arrays,
}  # fmt: skip
"""Answers of a channel on the batch, by animal."""


class Herd:
    """All runs of a batch at once."""

    Parameters = Options
    monitor_ids = ()

    def reset(self, context: Any) -> None:
        """Fail at once, or be ready."""
        first = context.parameters[0]
        self._channel, self._runs = context.channel_id, context.runs
        self._name, self._left = first.animal, first.from_tick
        if self._name == "fails_at_once":
            _raise(RuntimeError("no licence"))

    def act(self, observation: Any) -> Any:
        """Answer as the animal does, from its tick on."""
        self._left -= 1
        arrays: Arrays = {
            "channel": self._channel,
            "acceleration": np.full(self._runs, 0.1),
            "steering_angle": np.zeros(self._runs),
            "stamp": np.full(self._runs, observation.time),
            "status": np.full(self._runs, ports.OK),
        }
        if self._left < 0 and self._name in HERD:
            arrays = HERD[self._name](observation, arrays)
        return ports.ControlCommand(**arrays) if arrays else None
