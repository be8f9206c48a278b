"""The signals of a trace by name, and the dictionary of names that a formula may use."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from adeye import signals as columns
from adeye.judge.outcome import at_goal, in_refuge, on_road
from adeye.judge.series import (
    SERIES,
    TraceSeries,
    mark_errors,
    mark_undecided,
    series_signals,
)
from adeye.judge.stl.series import SampleStatus, declared_series
from adeye.kernel.relation import differences
from adeye.kernel.road import RULE_LIMIT, RULE_PART, RULE_WRONG_WAY, road_rules
from adeye.signals import (
    MOST_LANES,
    Bools,
    Bytes,
    Floats,
    SignalType,
    architecture_signals,
    scene_signals,
)
from adeye.trace import NO_TRACKS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.judge.stl.series import Series
    from adeye.spec.architecture import Architecture
    from adeye.spec.odd import Attributes
    from adeye.spec.scenario import LogicalScenario
    from adeye.trace import Layout, Trace

STANDSTILL_SPEED: Final = 0.05
"""Speed up to which the ego stands [m/s]."""

DECISION_FAMILIES: Final = (
    "channel",
    "authority",
    "switch",
    "sensor",
    "monitor",
    "fault",
    "faulted",
)
"""First words of signals that the last row of a run lacks: nothing is decided from it."""

_EGO: Final = {
    "x": columns.EGO_X,
    "y": columns.EGO_Y,
    "heading": columns.EGO_HEADING,
    "speed": columns.EGO_SPEED,
    "acceleration": columns.EGO_ACCELERATION,
    "steering_angle": columns.EGO_STEERING,
}
_PLACE: Final = {"lane": columns.PLACE_LANE, "lane_offset": columns.PLACE_OFFSET}
_RULES: Final = {"speed_limit": RULE_LIMIT, "strip": RULE_PART, "wrong_way": RULE_WRONG_WAY}
_OBJECT: Final = {
    "x": columns.OBJECT_X,
    "y": columns.OBJECT_Y,
    "heading": columns.OBJECT_HEADING,
    "speed": columns.OBJECT_SPEED,
    "acceleration": columns.OBJECT_ACCELERATION,
}


def is_decision(name: str) -> bool:
    """Tell whether a signal is of what was decided at a row, which the last row lacks.

    >>> is_decision("authority.safety"), is_decision("ego.speed")
    (True, False)
    """
    return name.partition(".")[0] in DECISION_FAMILIES


def plan_dictionary(
    scenario: LogicalScenario,
    architecture: Architecture,
    faults: Sequence[str] = (),
    monitors: Sequence[str] = (),
) -> Mapping[str, SignalType]:
    """List what a formula may name in the runs of a scenario and an architecture.

    Args:
        scenario: Its actors, static objects and lanes count.
        architecture: Its sensors and channels count.
        faults: Fault ids of the ODD, also those that the runs lack.
        monitors: Monitor ids that the channels declare.

    Returns:
        Signal types by name.
    """
    object_ids, road = (*scenario.actors, *scenario.world.objects), scenario.world.road
    lanes = MOST_LANES if road.kind == "imported" else road.lanes
    others = tuple(monitors), tuple(faults)
    return _named(object_ids, lanes, architecture, others)


def trace_dictionary(layout: Layout, faults: Sequence[str] = ()) -> Mapping[str, SignalType]:
    """List what a formula may name in recorded runs.

    Args:
        layout: Names behind the axes of the trace.
        faults: Fault ids of the ODD beside those of the trace.

    Returns:
        Signal types by name.
    """
    context = layout.context
    others = layout.monitors, tuple(dict.fromkeys((*layout.faults, *faults)))
    return _named(context.object_ids, context.road.lanes, layout.architecture, others)


def _named(
    objects: tuple[str, ...],
    lanes: int,
    architecture: Architecture,
    others: tuple[tuple[str, ...], tuple[str, ...]],
) -> Mapping[str, SignalType]:
    """List signals by what of an architecture they hang on."""
    from adeye.spec.channels import SafetyChannel

    channels = architecture.channels
    safety = (item for item in channels.values() if isinstance(item, SafetyChannel))
    seeing = frozenset(name for item in safety for name in item.object_monitors)
    return _dictionary(
        objects, lanes, tuple(architecture.sensors), tuple(channels), (*others, seeing)
    )


@lru_cache(maxsize=256)
def _dictionary(
    objects: tuple[str, ...],
    lanes: int,
    sensors: tuple[str, ...],
    channels: tuple[str, ...],
    others: tuple[tuple[str, ...], tuple[str, ...], frozenset[str]],
) -> Mapping[str, SignalType]:
    monitors, faults, seeing = others
    return {
        **scene_signals(objects, lanes),
        **architecture_signals(sensors, channels, monitors, faults, objects, seeing),
        **series_signals(),
        # The distance declares "no conflict", for runs without any object.
        "any_actor.distance": SERIES["distance"].type,
    }


class TraceSignals:
    """Signals of a trace; the source that formulas are evaluated on.

    The last row of a run has a scene and no decision: what channels, switch, sensors, monitors and
    faults say is not applicable there. Nor is the command of a channel that is silent. The age of
    a sample or command counts from the start of the run before the first.

    Attributes:
        trace: The runs.
        measured: Their metric series.
        inside_odd: (B,) whether the planned attributes lie inside the ODD.
    """

    def __init__(
        self,
        trace: Trace,
        inside_odd: Bools,
        attributes: Attributes | None = None,
        faults: Sequence[str] = (),
    ) -> None:
        """Prepare the signals of a trace.

        Args:
            trace: The runs.
            inside_odd: (B,) whether the planned attributes lie inside the ODD.
            attributes: Attributes of the ODD, for leaving it during a run.
            faults: Fault ids of the ODD beside those of the trace; they are never active.
        """
        self.trace = trace
        self.measured = TraceSeries(trace)
        self.inside_odd: Bools = np.asarray(inside_odd, dtype=np.bool_)
        if self.inside_odd.shape != trace.length.shape:
            msg = f"inside_odd has shape {self.inside_odd.shape}, not ({trace.runs},)"
            raise ValueError(msg)
        self._attributes, self._faults = attributes, faults
        limits = None if attributes is None else attributes.dynamic_elements.ego_speed
        self._max_speed = np.inf if limits is None else limits.max
        self._read: dict[str, Series] = {}

    @cached_property
    def dictionary(self) -> Mapping[str, SignalType]:
        """Type of every signal, by name."""
        return trace_dictionary(self.trace.layout, self._faults)

    def part(self, first: int, end: int) -> TraceSignals:
        """Give the signals of the runs from ``first`` to before ``end``, without a copy."""
        trace = self.trace
        bare = replace(trace, columns={}).select(range(first, end))
        columns = {name: values[first:end] for name, values in trace.columns.items()}
        part = TraceSignals(
            replace(bare, columns=columns),
            self.inside_odd[first:end],
            self._attributes,
            self._faults,
        )
        part.dictionary = self.dictionary
        return part

    def series(self, name: str) -> Series:
        """Give the series of a signal.

        Raises:
            KeyError: The trace has no such signal.
        """
        if name not in self._read:
            self._read[name] = self._series(name)
        return self._read[name]

    @cached_property
    def is_standstill(self) -> Bools:
        """(B, T) whether the ego stands."""
        return np.asarray(np.abs(self._ego(columns.EGO_SPEED)) <= STANDSTILL_SPEED)

    @cached_property
    def is_on_road(self) -> Bools:
        """(B, T) whether the centre of the ego is on the road, see ``on_road``."""
        return on_road(self.trace.layout.context.road, cast("Floats", self._column("ego_place")))

    @cached_property
    def is_safe_state(self) -> Bools:
        """(B, T) whether the ego stands on the road, clear of every object."""
        return np.asarray(self.is_standstill & self.is_on_road & ~self.measured.touched)

    @cached_property
    def _rules(self) -> Floats:
        places = cast("Floats", self._column("ego_place"))
        align = self._ego(columns.EGO_HEADING) - places[..., columns.PLACE_HEADING]
        place = places[..., columns.PLACE_S], places[..., columns.PLACE_D]
        return road_rules(self.trace.layout.context.road.grounds(), *place, align)

    def _series(self, name: str) -> Series:
        if name in SERIES:
            return self.measured.series(name)
        if name not in self.dictionary:
            raise KeyError(name)
        family, _, rest = name.partition(".")
        reader = _READERS.get(family)
        values, status, actor = reader(self, rest) if reader else self._state(name)
        if is_decision(name):
            mark_undecided(self.trace.length, status)
        return declared_series(self.dictionary[name], values, status, actor)

    def _column(self, name: str) -> NDArray[Any]:
        return self.measured.column(name)

    def _ego(self, column: int) -> Floats:
        return cast("Floats", self._column("ego")[..., column])

    def _place(self, column: int) -> Floats:
        return cast("Floats", self._column("ego_place")[..., column])

    def _state(self, name: str) -> Reading:
        """Read time and the truth values about the whole run."""
        if name == "time":
            times = np.broadcast_to(self.trace.time, self.measured.shape)
            return times, np.zeros(times.shape, dtype=np.int8), None
        speed, d = self._ego(columns.EGO_SPEED), self._place(columns.PLACE_D)
        if name == "contact":
            touched = self._column("contact")
            return _reading(touched >= 0, actor=touched)
        if name == "standstill":
            return _reading(self.is_standstill, speed)
        if name == "safe_state":
            return _reading(self.is_safe_state, speed, d)
        inside = (
            self.inside_odd[:, np.newaxis]
            & self.is_on_road
            & (differences(speed, self._max_speed) <= 0.0)
        )
        return _reading(inside, speed, d)

    def _of_ego(self, what: str) -> Reading:
        d, heading = self._place(columns.PLACE_D), self._ego(columns.EGO_HEADING)
        if what == "on_road":
            return _reading(self.is_on_road, d)
        if what == "in_refuge":
            places = cast("Floats", self._column("ego_place"))
            stands = in_refuge(self.trace.layout.context, places, heading)
            return _reading(stands, d, heading)
        if what == "at_goal":
            return _reading(at_goal(self.trace), self._place(columns.PLACE_S))
        if what in _RULES:
            rule = self._rules[..., _RULES[what]]
            asked = rule.astype(np.bool_) if what == "wrong_way" else rule
            return _reading(asked, d, heading)
        if what in _PLACE:
            return _reading(self._place(_PLACE[what]), d)
        return _reading(self._ego(_EGO[what]))

    def _of_actor(self, rest: str) -> Reading:
        actor, _, what = rest.rpartition(".")
        index = self.trace.layout.context.object_ids.index(actor)
        if what == "lane":
            place = self._column("object_places")[:, :, index]
            values, *checked = place[..., columns.PLACE_LANE], place[..., columns.PLACE_D]
        elif what in _OBJECT:
            values, checked = self._column("objects")[:, :, index, _OBJECT[what]], []
        else:
            measured = self.measured
            measure = measured.object_distance if what == "distance" else measured.object_gap
            values, checked = measure(index), []
        own = np.full(values.shape, index, dtype=np.int64)
        return _reading(values, *checked, actor=own)

    def _of_any_actor(self, _what: str) -> Reading:
        samples = self.measured.samples("distance")
        return samples.values, samples.status, samples.actor.astype(np.int64, copy=False)

    def _of_channel(self, rest: str) -> Reading:
        channel, what, *actor = rest.split(".", 2)
        index = self.trace.layout.channels.index(channel)
        if actor:
            return self._tracks(index, actor[0])
        if what == "age":
            return self._age(self._column("stamp")[..., index])
        values, status, nobody = _reading(self._column(what)[..., index])
        if what != "status":
            silent = self._column("status")[..., index] == columns.SILENT
            status[silent] = SampleStatus.NOT_APPLICABLE
        return values, status, nobody

    def _tracks(self, channel: int, actor: str) -> Reading:
        """Read whether a channel tracks an actor; a silent one tracks nothing."""
        thing = self.trace.layout.context.object_ids.index(actor)
        is_tracked = np.isfinite(self._column("track_error")[:, :, channel, thing, 0])
        values, status, nobody = _reading(is_tracked)
        hidden = self._column("false_tracks")[..., channel] == NO_TRACKS
        status[hidden & (self._column("status")[..., channel] != columns.SILENT)] = (
            SampleStatus.NOT_APPLICABLE
        )
        return values, status, nobody

    def _of_authority(self, channel: str) -> Reading:
        return _reading(self._column("authority") == self.trace.layout.channels.index(channel))

    def _of_sensor(self, rest: str) -> Reading:
        sensor, what, *actor = rest.split(".", 2)
        index = self.trace.layout.sensors.index(sensor)
        if what == "alive":
            return _reading(self._column("sensor_alive")[..., index])
        if what == "age":
            return self._age(self._column("sensor_stamp")[..., index])
        thing = self.trace.layout.context.object_ids.index(actor[0])
        return _reading(self._column("detected")[..., index, thing])

    def _of_monitor(self, rest: str) -> Reading:
        monitor, _, what = rest.rpartition(".")
        index = self.trace.layout.monitors.index(monitor)
        return _reading(self._column("monitors")[..., index, int(what == "confirmed")])

    def _of_fault(self, rest: str) -> Reading:
        fault = rest.rpartition(".")[0]
        if fault not in self.trace.layout.faults:
            return _reading(np.zeros(self.measured.shape, dtype=np.bool_))
        return _reading(self._column("fault_active")[..., self.trace.layout.faults.index(fault)])

    def _of_faulted(self, _what: str) -> Reading:
        return _reading(np.logical_or.accumulate(self._column("fault_active").any(axis=-1), axis=1))

    def _of_switch(self, _what: str) -> Reading:
        return _reading(self._column("reason"))

    def _age(self, stamp: Floats) -> Reading:
        # The difference of two times, to the picosecond: ages that are alike are one number.
        age = np.round(self.trace.time - np.where(stamp < 0.0, 0.0, stamp), 12)
        return _reading(age, stamp)


Reading = tuple["NDArray[Any]", Bytes, "NDArray[np.int64] | None"]
"""Values, status and actor of a signal (B, T)."""


def _reading(
    values: NDArray[Any], *inputs: Floats, actor: NDArray[np.int64] | None = None
) -> Reading:
    """Give values with status VALUE, but ERROR where they or their inputs are not finite."""
    status: Bytes = np.zeros(values.shape, dtype=np.int8)
    for checked in (values, *inputs):
        if checked.dtype.kind == "f":
            mark_errors(np.ascontiguousarray(checked), status)
    return values, status, actor


_READERS: Final[Mapping[str, Callable[[TraceSignals, str], Reading]]] = {
    "ego": TraceSignals._of_ego,
    "actor": TraceSignals._of_actor,
    "any_actor": TraceSignals._of_any_actor,
    "channel": TraceSignals._of_channel,
    "authority": TraceSignals._of_authority,
    "sensor": TraceSignals._of_sensor,
    "monitor": TraceSignals._of_monitor,
    "fault": TraceSignals._of_fault,
    "faulted": TraceSignals._of_faulted,
    "switch": TraceSignals._of_switch,
}
