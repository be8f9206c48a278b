"""The safety channel with a supervisor: monitors of its own choice, levels, manoeuvres."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.channels.links import linked_channels
from adeye.channels.safety.kinds import (
    CHANGE_ROW,
    CHANGE_STAMP,
    RULE_FIRST,
    RULE_ROW,
    SENSOR_ROW,
    SENSOR_STAMP,
    Watch,
)
from adeye.channels.safety.manoeuvres import FORCE_ROW, SET_EVERY, SET_OF_LEVEL, SET_ROW, Force
from adeye.channels.safety.planned import PlannedSafetyChannel
from adeye.channels.safety.planning import Plans, show_plan
from adeye.channels.safety.supervising import supervised_step
from adeye.channels.safety.supervision import Batch, tell
from adeye.kernel.jit import compiled
from adeye.signals import Floats, Ints, spec_columns
from adeye.spec.architecture import HEALTH
from adeye.spec.supervisor import KINDS, MANOEUVRE_MONITORS, MANOEUVRES, Monitor

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.ports import ChannelContext
    from adeye.signals import Observation
    from adeye.spec.channels import SafetyParameters
    from adeye.spec.supervisor import Supervisor

_ENDLESS: Final = math.inf

THRESHOLDS: Final[Mapping[str, Mapping[str, float]]] = {
    "channel_silent": {"timeout": _ENDLESS},
    "channel_implausible": {
        "max_acceleration": _ENDLESS,
        "max_lateral_acceleration": _ENDLESS,
        "max_lateral_error": _ENDLESS,
        "max_jerk": _ENDLESS,
        "max_steering_rate": _ENDLESS,
    },
    "channel_stuck": {"timeout": _ENDLESS, "min_speed": 0.0},
    "sensor_silent": {"timeout": _ENDLESS, "max_age": _ENDLESS},
    "off_road": {"margin": 0.0},
    "lane_departure": {"max_offset": _ENDLESS},
    "object_danger": {"threshold": _ENDLESS},
    "critical_area": {"time": 0.0, "width_factor": 0.0},
    "rss_danger": {
        "response_time": 0.0,
        "acceleration": 0.0,
        "least_braking": 0.0,
        "most_braking": 0.0,
    },
    "odd_exit": {
        "max_speed": _ENDLESS,
        "from_s": -_ENDLESS,
        "to_s": _ENDLESS,
        "from_d": -_ENDLESS,
        "to_d": _ENDLESS,
    },
    "last_safe_stop": {},
}
"""Thresholds of each kind in the order of a rule's columns, and what stands for one not given."""


class SupervisedSafetyChannel(PlannedSafetyChannel):
    """Supervises with the monitors that its parameters name, and does what their levels ask for.

    The monitors are asked at the supervisor's rate; each is confirmed and cleared by its counter.
    The highest level among the confirmed ones asks for a manoeuvre: to go on, to go on until a rest
    area or a place at the side of the road can be reached, or to stop at once. Three columns beside
    the monitors tell which is asked for, and which is in force.
    """

    def __init__(self, parameters: SafetyParameters) -> None:
        """Take the monitors from the parameters of any run; they are structure.

        Args:
            parameters: With a supervisor.
        """
        supervisor = _of(parameters)
        self._names = tuple(supervisor.monitors)
        self._watches = tuple(
            tuple(getattr(monitor, "watches", ())) for monitor in supervisor.monitors.values()
        )
        self._kinds = tuple(monitor.kind for monitor in supervisor.monitors.values())
        self._is_planned = parameters.stop == "planned"
        self.monitor_ids = (*self._names, *MANOEUVRE_MONITORS)

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        super().reset(context)
        runs, count = context.runs, len(self._names)
        columns = spec_columns(context.parameters, self._numbers_of)
        shape = (runs, count, RULE_ROW)
        rules = np.zeros(shape)
        for row in range(count):
            for column in range(RULE_ROW):
                rules[:, row, column] = columns[f"{row}/{column}"]
        settings = np.stack([columns[f"set/{column}"] for column in range(SET_ROW)], axis=1)
        settings[:, SET_EVERY] = np.round(1.0 / (settings[:, SET_EVERY] * context.period))
        for row in range(count):
            # A monitor begins healed.
            self._states[:, row, 0] = rules[:, row, RULE_FIRST - 1].astype(np.int64)
        self._sensors, watched = self._wire(context)
        sensors, channels = len(self._sensors), len(linked_channels(context.links))
        known = np.zeros((runs, sensors, SENSOR_ROW))
        known[:, :, SENSOR_STAMP] = -1.0
        changes = np.zeros((runs, channels, CHANGE_ROW))
        changes[:, :, CHANGE_STAMP] = -1.0
        self._watch = Watch(
            rules=rules,
            watched=watched,
            stamps=np.full((runs, sensors), -1.0),
            alive=np.ones((runs, sensors), dtype=np.bool_),
            sensors=known,
            changes=changes,
            known=np.zeros(runs, dtype=np.bool_),
        )
        self._force = Force(settings, np.zeros((runs, FORCE_ROW)))

    def _wire(self, context: ChannelContext) -> tuple[tuple[str, ...], Ints]:
        """Return the links of the watched sensors, and what each monitor watches by number."""
        channels = linked_channels(context.links)
        sensors: list[str] = []
        widest = max([1, *map(len, self._watches)])
        watched = np.full((len(self._names), widest), -1, dtype=np.int64)
        for row, (kind, names) in enumerate(zip(self._kinds, self._watches, strict=True)):
            for place, name in enumerate(names):
                if kind != "sensor_silent":
                    watched[row, place] = channels.index(name)
                    continue
                link = f"{HEALTH}{name}" if f"{HEALTH}{name}" in context.links else name
                if link not in sensors:
                    sensors.append(link)
                watched[row, place] = sensors.index(link)
        return tuple(sensors), watched

    def _numbers_of(self, parameters: SafetyParameters) -> dict[str, float]:
        supervisor = _of(parameters)
        numbers: dict[str, float] = {}
        for row, (name, monitor) in enumerate(supervisor.monitors.items()):
            for column, value in enumerate(_rule(supervisor, name, monitor)):
                numbers[f"{row}/{column}"] = value
        asked = [float(MANOEUVRES.index(word) + 1) for word in supervisor.manoeuvres.values()]
        first = [supervisor.rate, supervisor.patience, supervisor.least_distance, supervisor.sight]
        assert len(first) == SET_OF_LEVEL
        return numbers | {f"set/{column}": value for column, value in enumerate(first + asked)}

    def _read(self, observation: Observation) -> None:
        super()._read(observation)
        for row, link in enumerate(self._sensors):
            measurement = observation.measurements[link]
            self._watch.stamps[:, row] = measurement.stamp
            self._watch.alive[:, row] = measurement.alive

    def _decide(self, time: float) -> None:
        _act(
            self._batch(),
            self._plans(),
            self._watch,
            self._force,
            time,
            self._is_planned,
            self._shows,
            self._candidates,
            self._costs,
            self._chosen,
        )


def _of(parameters: Any) -> Supervisor:
    supervisor: Supervisor = parameters.supervisor
    return supervisor


def _rule(supervisor: Supervisor, name: str, monitor: Monitor) -> list[float]:
    """List the columns of a rule, see ``kinds.RULE_KIND``."""
    counter = supervisor.counter_of(name)
    values = [KINDS.index(monitor.kind), monitor.level, counter.increment, counter.decrement]
    values += [counter.fault, counter.heal]
    rule = [float(value) for value in values]
    for field, missing in THRESHOLDS[monitor.kind].items():
        value = getattr(monitor, field)
        rule.append(missing if value is None else float(value))
    return rule + [0.0] * (RULE_ROW - len(rule))


@compiled
def _act(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    watch: Watch,
    force: Force,
    time: float,
    planned: bool,  # noqa: FBT001 - a kernel
    shows: bool,  # noqa: FBT001 - a kernel
    candidates: Floats,
    costs: Floats,
    chosen: Ints,
) -> None:
    for run in range(batch.records.shape[0]):
        if not batch.running[run]:
            continue
        state = supervised_step(batch, plans, watch, force, run, time, planned, shows)
        tell(batch, run, state)
        if shows and planned:
            show_plan(batch, plans, run, state, candidates, costs, chosen)
