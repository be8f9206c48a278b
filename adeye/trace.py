"""The recorded signals of a batch of runs: columns, lengths and the digest of each run.

Row k holds what was true at t_k and what was decided from it; the last row of a run has a scene
only. Rows beyond a run's length are zero and never read.

Called itself, the module is the public function of its name.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye.called import call_as_function
from adeye.kernel.digest import LANES, absorb_bytes, absorb_words, finish

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from adeye.signals import Bools, Floats, Ints, SceneContext
    from adeye.spec.architecture import Architecture

call_as_function(__name__)

TRACE_SCHEMA: Final = "adeye/trace@3"

LINK_TICKS: Final = 100
"""Rows between two links of the digest chain of a run."""

COLUMNS: Final = {
    "ego": "(B, T, 7) ego state, signals.EGO_COLUMNS",
    "ego_place": "(B, T, 6) ego on the road, signals.PLACE_COLUMNS",
    "objects": "(B, T, M, 5) object states, signals.OBJECT_COLUMNS",
    "object_places": "(B, T, M, 6) objects on the road, signals.PLACE_COLUMNS",
    "begun": "(B, T, V) time at which each storyboard event began [s], NaN before, inf if it lost",
    "contact": "(B, T) object touched, -1 for none",
    "impact_speed": "(B, T) relative speed at contact [m/s]",
    "foreign_contact": "(B, T) two other actors touch",
    "sensor_stamp": "(B, T, S) time of the newest sample [s], -1 before the first",
    "sensor_alive": "(B, T, S) the sensor delivers",
    "detected": "(B, T, S, M) the newest sample has the object",
    "detections": "(B, T, S, M, 2) its measured place in the map, by object [m]",
    "points": "(B, T, L, P, 2) returns of the newest sample of each lidar in the map, not of the "
    "ground, evenly thinned to at most P, NaN where none [m]",
    "acceleration": "(B, T, C) commanded acceleration of each channel, after faults [m/s²]",
    "steering_angle": "(B, T, C) commanded steering angle of each channel, after faults [rad]",
    "stamp": "(B, T, C) time of the observation behind the command [s]",
    "status": "(B, T, C) state of each channel, signals.STATUS_LABELS",
    "monitors": "(B, T, Q, 2) raw and confirmed",
    "tracks": "(B, T, C, K, 6) tracks of each channel, signals.TRACK_COLUMNS, NaN where none",
    "track_error": "(B, T, C, M, 2) track of an object minus the object, along and across the line"
    " of sight from the ego at the time of the observation [m], NaN without a confirmed track",
    "false_tracks": "(B, T, C) confirmed tracks of nothing, near the path; -1 shows no tracks",
    "candidates": "(B, T, C, P, Q, 2) trajectories that a channel chose from, in the map [m]",
    "candidate_costs": "(B, T, C, P) what they cost, inf where limits forbid, NaN where none",
    "chosen": "(B, T, C) which of them it chose, -1 for none",
    "authority": "(B, T) index of the acting channel, -1 for none",
    "reason": "(B, T) why, signals.REASON_LABELS",
    "command": "(B, T, 2) acting acceleration [m/s²] and steering angle [rad]",
    "fault_active": "(B, T, F) the fault is present",
}
"""Every column of a trace, in the order in which the digest covers them."""

PRESENCE: Final = "fault_active"
"""The last column that the digest covers: what lies before it is what the faults brought about."""

NO_TRACKS: Final = -1
"""Number of false tracks of a channel that does not show its tracks."""

DRAWN: Final = frozenset(
    {"detections", "points", "tracks", "candidates", "candidate_costs", "chosen"}
)
"""Columns for pictures of a run: the digest leaves them out, so that a campaign need not keep them.
They have no entries (M, K, P = 0) where they were not asked for, and none of the candidates where
no channel shows any."""


class Picture(NamedTuple):
    """An image of a physical camera, which no trace holds: it is taken while a run is executed.

    Attributes:
        time: When it was taken [s].
        pixels: (rows, columns) number of the object that a pixel shows, -1 where it shows none and
            -2 where noise looks like something; row 0 is at the top.
    """

    time: float
    pixels: NDArray[np.int16]


Album = dict[str, list[Picture]]
"""Images by the camera that took them, in order of time."""


class Moved(NamedTuple):
    """What a storyboard event moves.

    Attributes:
        object: Its actor, among the objects.
        along: Whether it is about the actor's speed.
        across: Whether it is about its lateral place.
    """

    object: int
    along: bool
    across: bool


@dataclass(frozen=True, slots=True)
class Layout:
    """Names behind the axes of a trace's columns.

    Attributes:
        scenario: Id of the scenario in its ODD.
        architecture: The architecture of the group's first test case: ids and structure.
        architectures: B architectures of the runs, swept values applied.
        sensors: S ids.
        channels: C ids.
        monitors: Q ids.
        faults: F ids: the faults of the test cases' entry.
        context: Objects, sizes, roads and surroundings of the runs.
        horizon: Obligations start within it [s].
        tail: What is simulated after it [s].
        realised: Storyboard events that must begin within the horizon.
        moved: What each storyboard event moves, in the order of the context's.
    """

    scenario: str
    architecture: Architecture
    architectures: tuple[Architecture, ...]
    sensors: tuple[str, ...]
    channels: tuple[str, ...]
    monitors: tuple[str, ...]
    faults: tuple[str, ...]
    context: SceneContext
    horizon: float
    tail: float
    realised: tuple[str, ...]
    moved: tuple[Moved, ...] = ()

    @property
    def lidars(self) -> tuple[str, ...]:
        """Ids of the L sensors whose returns a trace may keep."""
        from adeye.spec.sensors import PhysicalLidar

        sensors = self.architecture.sensors
        return tuple(name for name in self.sensors if isinstance(sensors.get(name), PhysicalLidar))


@dataclass(frozen=True, slots=True)
class ChannelEvent:
    """The first failure of a channel in a run.

    Attributes:
        outcome: What the run's outcome is.
        channel: Id.
        time: [s].
        detail: What was wrong.
        is_machine_dependent: Whether a deadline on the wall clock, or another bound that depends on
            the machine's speed or load, was hit in the run.
        later: First failures of other channels in the same run, in order of time.
    """

    outcome: str
    channel: str
    time: float
    detail: str
    is_machine_dependent: bool = False
    later: tuple[ChannelEvent, ...] = ()


@dataclass(frozen=True, slots=True)
class Trace:
    """The recorded signals of B runs.

    Attributes:
        layout: Names behind the axes.
        time: (T,) [s].
        length: (B,) rows that a run has.
        horizon_row: (B,) last row at which an obligation may start.
        complete: (B,) whether the run ended by goal or horizon, not by contact or the road's end.
        columns: Arrays by name, see ``COLUMNS``.
        channel_events: First failure of a channel in each run, or None.
        case_digests: Digest of the test case behind each run.
    """

    layout: Layout
    time: Floats
    length: Ints
    horizon_row: Ints
    complete: Bools
    columns: dict[str, Floats | Ints | Bools]
    channel_events: tuple[ChannelEvent | None, ...]
    case_digests: tuple[str, ...]
    _digests: list[tuple[str, str]] = field(default_factory=list, repr=False, compare=False)
    _chains: list[tuple[str, ...]] = field(default_factory=list, repr=False, compare=False)

    @property
    def runs(self) -> int:
        """Number of runs B."""
        return int(self.length.shape[0])

    def __getitem__(self, name: str) -> Floats | Ints | Bools:
        """Return a column by its name."""
        return self.columns[name]

    def digests(self) -> list[str]:
        """Hash the values of every run to 128 bits, in hex: all columns but those for pictures."""
        return [whole for _, whole in self._both()]

    def still_has(self, digests: Sequence[str]) -> bool:
        """Tell whether the values of every run are those that once had these digests."""
        return [whole for _, whole in self._digest()] == self.digests() == list(digests)

    def _both(self) -> list[tuple[str, str]]:
        if not self._digests:
            self._digests.extend(self._digest())
        return self._digests

    def _digest(self) -> list[tuple[str, str]]:
        """Hash the values of every run: all but which faults are present, and all."""
        lanes = np.zeros((self.runs, LANES), dtype=np.uint64)
        rows = self.length.astype(np.int64)
        ends = np.stack([rows, self.horizon_row, self.complete], axis=1).astype(np.int64)
        _absorb(TRACE_SCHEMA, ends, np.full(self.runs, ends.shape[1]), lanes)
        _absorb("time", np.tile(self.time, (self.runs, 1)), rows, lanes)
        for name in COLUMNS:
            if name not in {*DRAWN, PRESENCE}:
                _absorb(name, self.columns[name], rows, lanes)
        effects = _hex(lanes)
        _absorb(PRESENCE, self.columns[PRESENCE], rows, lanes)
        return list(zip(effects, _hex(lanes), strict=True))

    def chains(self) -> list[tuple[str, ...]]:
        """Hash what happened up to every ``LINK_TICKS`` rows of each run, and then the whole run.

        Link k covers the rows before ``LINK_TICKS * (k + 1)`` of every column that the digest
        covers, so that two runs that agree that far have equal links. The last link is the
        digest of the trace; the one before it covers all of that but whether faults are present,
        so that runs whose faults change nothing are known as equal.
        """
        if not self._chains:
            ends = self._both()
            prefixes = self._prefixes()
            self._chains.extend(
                (*(link[run] for link in prefixes[: rows // LINK_TICKS]), *ends[run])
                for run, rows in enumerate(self.length.tolist())
            )
        return self._chains

    def _prefixes(self) -> list[list[str]]:
        """Hash the rows before each multiple of ``LINK_TICKS``: links, each with all runs."""
        lanes = np.zeros((self.runs, LANES), dtype=np.uint64)
        rows = self.length.astype(np.int64)
        found = []
        for first in range(0, int(rows.max(initial=0)) - LINK_TICKS + 1, LINK_TICKS):
            counts = np.clip(rows - first, 0, LINK_TICKS)
            for name in COLUMNS:
                if name not in DRAWN:
                    part = self.columns[name][:, first : first + LINK_TICKS]
                    _absorb(name, np.ascontiguousarray(part), counts, lanes)
            found.append(_hex(lanes))
        return found

    def select(self, runs: Sequence[int]) -> Trace:
        """Keep some runs, for instance to draw one of them."""
        chosen = np.asarray(runs, dtype=np.int64)
        return Trace(
            layout=replace(
                self.layout,
                architectures=tuple(self.layout.architectures[run] for run in runs),
                context=_context_of(self.layout.context, chosen),
            ),
            time=self.time,
            length=self.length[chosen],
            horizon_row=self.horizon_row[chosen],
            complete=self.complete[chosen],
            columns={name: values[chosen] for name, values in self.columns.items()},
            channel_events=tuple(self.channel_events[run] for run in runs),
            case_digests=tuple(self.case_digests[run] for run in runs),
        )


def _absorb(name: str, values: NDArray[Any], rows: Ints, lanes: NDArray[np.uint64]) -> None:
    """Take the first rows of each run of a column into its lanes.

    Args:
        name: Of the column.
        values: (B, T, ...).
        rows: (B,).
        lanes: (B, LANES) in and out.
    """
    what = f"{name} {values.dtype.str} {values.shape[2:]}".encode()
    key = np.uint64(int.from_bytes(hashlib.blake2b(what, digest_size=8).digest(), "little"))
    size = int(np.prod(values.shape[2:]))
    # Rows of one run lie one after the other, also in a column that was cut to the longest run.
    flat = values.reshape(values.shape[0], values.shape[1] * size)
    if values.dtype.itemsize == 8:
        absorb_words(flat.view(np.uint64), rows * size, key, lanes)
    else:
        absorb_bytes(flat.view(np.uint8), rows * size * values.dtype.itemsize, key, lanes)


def _hex(lanes: NDArray[np.uint64]) -> list[str]:
    """Mix the lanes (B, LANES) of each run into 128 bits, in hex; they can take more after it."""
    out = np.empty((lanes.shape[0], 2), dtype="<u8")
    finish(lanes, out)
    text = out.tobytes().hex()
    return [text[place : place + 32] for place in range(0, len(text), 32)]


def _context_of(context: SceneContext, runs: Ints) -> SceneContext:
    """Keep the sizes, roads, surroundings and seeds of some runs."""
    return replace(
        context,
        object_sizes=context.object_sizes[runs],
        object_reflectivity=context.object_reflectivity[runs],
        ego_size=context.ego_size[runs],
        stream_seeds=context.stream_seeds[runs],
        road=context.road.of(runs),
        surroundings=context.surroundings.of(runs),
    )
