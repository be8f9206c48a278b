"""What follows a fault in one run, as times: effect, detection, reaction, safe state, violation.

The run is held against its fault-free twin (the same test case without faults) and against its
mechanism-off twin (the same test case with the default channel acting throughout). Nothing is
simulated here.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np

from adeye.judge.intervals import (
    Intervals,
    alarms,
    brakes,
    degradation,
    intervals,
    operates_in_emergency,
    others_act,
)
from adeye.judge.metrics.scans import safe_from
from adeye.judge.outcome import on_road
from adeye.judge.statistics import wilson
from adeye.judge.trace_signals import STANDSTILL_SPEED
from adeye.signals import EGO_SPEED, PLACE_D
from adeye.trace import COLUMNS, DRAWN

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.judge.statistics import Interval
    from adeye.signals import Bools, Floats
    from adeye.trace import Trace

# --- What follows a fault in one run, as times: effect, detection, reaction, safe state,
# violation.

InjectionClass = Literal[
    "not_activated",
    "masked",
    "detected_in_time",
    "detected_late",
    "undetected_no_violation",
    "undetected_violation",
]
CLASSES: Final[tuple[InjectionClass, ...]] = get_args(InjectionClass)
"""What became of an injected fault, from harmless to violation."""

TIMELINE_VERSION: Final = 1
"""Raised whenever a timeline or a class can change although the traces do not."""

_BEHAVIOUR: Final = ("ego", "command", "contact")
"""Columns of what the ego does; the others are what it sees, believes and considers."""
_DECIDED: Final = frozenset(
    {"sensor_stamp", "sensor_alive", "detected", "acceleration", "steering_angle", "stamp"}
    | {"status", "monitors", "track_error", "false_tracks", "authority", "reason", "command"}
)
"""Columns of what was decided at a row, which the last row of a run lacks."""


@dataclass(frozen=True, slots=True)
class Timeline:
    """Times of one run [s]; None for what did not happen before it ended.

    Attributes:
        fault_s: A fault is present.
        effect_s: Anything but the fault's own state differs from the fault-free twin.
        deviation_s: The ego moves or is commanded otherwise than in the twin.
        detect_s: A monitor is confirmed, or the switch finds the acting channel unusable, which is
            not so in the twin at that time.
        switch_s: Another channel than the default acts.
        brake_s: The acting command brakes, which that of the twin does not at that time.
        emergency_s: Emergency operation: another channel than the default acts, and brakes, stands
            or drives a minimal-risk manoeuvre; or a supervisor lets the drive go on in spite of its
            alarms.
        safe_s: The ego stands on the road, clear of every object, to the end. Shoulder, parking
            bays, rest areas and free verge belong to the road.
        violation_s: It touches something, or its centre leaves the road.
    """

    fault_s: float | None
    effect_s: float | None = None
    deviation_s: float | None = None
    detect_s: float | None = None
    switch_s: float | None = None
    brake_s: float | None = None
    emergency_s: float | None = None
    safe_s: float | None = None
    violation_s: float | None = None

    @property
    def intervals(self) -> Intervals:
        """Intervals between the times, shape (1,), NaN for those that are not there."""
        times = (self.fault_s, self.detect_s, self.emergency_s, self.safe_s)
        known = np.array([math.nan if time is None else time for time in times])
        return intervals(*known.reshape(4, 1))

    @property
    def fdti_s(self) -> float | None:
        """Fault detection time interval: from the fault to its detection [s]."""
        return _number(self.intervals.fdti)

    @property
    def frti_s(self) -> float | None:
        """Fault reaction time interval: from detection to safe state or emergency operation [s]."""
        return _number(self.intervals.frti)

    @property
    def fhti_s(self) -> float | None:
        """Fault handling time interval, FDTI and FRTI together [s]; None without detection."""
        return _number(self.intervals.fhti)

    @property
    def emergency_operation_s(self) -> float | None:
        """Emergency operation time interval: until the safe state [s]."""
        return _number(self.intervals.eoti)

    @property
    def fault_to_violation_s(self) -> float | None:
        """Time from the fault to the violation [s]; of the mechanism-off twin it is the FTTI."""
        if self.fault_s is None or self.violation_s is None:
            return None
        return self.violation_s - self.fault_s


def _number(value: NDArray[np.float64]) -> float | None:
    return None if math.isnan(value[0]) else float(value[0])


def classify_injection(timeline: Timeline, ftti_s: float | None) -> InjectionClass:
    """Say what became of an injected fault.

    Args:
        timeline: Of the run with the fault.
        ftti_s: Fault-tolerant time interval [s]; None where the mechanism-off twin violates
            nothing before it ends.

    Returns:
        ``not_activated`` if the fault was not present within the horizon or changed no bit; else by
        violation and detection. A detection after the violation, a reaction that the run does not
        show, and one that takes as long as the FTTI are ``detected_late``. ``masked`` is a fault
        that the ego's motion and command never show, and nobody detects.

    Source:
        ISO 26262-1:2018, 3.54 to 3.61 for the intervals; Avizienis et al. (2004), "Basic concepts
        and taxonomy of dependable and secure computing", for activation and propagation.
    """
    if timeline.fault_s is None or (timeline.effect_s is None and timeline.violation_s is None):
        return "not_activated"
    if timeline.detect_s is not None:
        limit = math.inf if ftti_s is None else ftti_s
        is_handled = timeline.fhti_s is not None and timeline.fhti_s < limit
        in_time = is_handled and timeline.violation_s is None
        return "detected_in_time" if in_time else "detected_late"
    if timeline.violation_s is not None:
        return "undetected_violation"
    return "masked" if timeline.deviation_s is None else "undetected_no_violation"


def timeline(trace: Trace, run: int, twin: Trace, twin_run: int) -> Timeline:
    """Read the times of one run against its fault-free twin.

    Args:
        trace: With the run; without a fault in it only the violation is told, from the start.
        run: Its row.
        twin: With the fault-free twin.
        twin_run: Its row.

    Raises:
        ValueError: The two have not the same clock, sensors, channels and monitors.
    """
    one, two = trace.layout, twin.layout
    shared = min(len(trace.time), len(twin.time))
    parts = ("scenario", "sensors", "channels", "monitors")
    alike = all(getattr(one, part) == getattr(two, part) for part in parts)
    if not alike or not np.array_equal(trace.time[:shared], twin.time[:shared]):
        msg = f"{two.scenario} of {two.channels} is no twin of {one.scenario} of {one.channels}"
        raise ValueError(msg)
    view, other = _View(trace, run), _View(twin, twin_run)
    # Obligations begin within the horizon: what comes in the tail is no injection.
    within = slice(0, int(trace.horizon_row[run]) + 1)
    onset = _first(np.asarray(view.decided("fault_active")[within].any(axis=1)), 0)
    time = trace.time
    if onset is None:
        return Timeline(None, violation_s=_at(time, _first(view.violates(), 0)))
    default = trace.layout.channels.index(trace.layout.architecture.switch.default)
    acts = others_act(view.decided("authority"), default)
    own, theirs = view.acceleration(), brakes(other.acceleration())
    degraded = degradation(view.decided("monitors"), trace.layout.monitors)
    speed = view.rows("ego")[:-1, EGO_SPEED]
    emergency = operates_in_emergency(acts, own, speed, degraded)
    safe = view.safe_from()
    rows = {
        "effect_s": _departure(view, other, tuple(COLUMNS), onset),
        "deviation_s": _departure(view, other, _BEHAVIOUR, onset),
        "detect_s": _first(_own_alarms(view, other), onset),
        "switch_s": _first(acts, onset),
        "brake_s": _first(brakes(own) & ~_padded(theirs, len(own)), onset),
        "emergency_s": _first(emergency, onset),
        "safe_s": None if safe is None else max(safe, onset),
        "violation_s": _first(view.violates(), onset),
    }
    return Timeline(_at(time, onset), **{name: _at(time, row) for name, row in rows.items()})


class _View:
    """The rows of one run of a trace."""

    def __init__(self, trace: Trace, run: int) -> None:
        self.trace, self.run = trace, run
        self.length = int(trace.length[run])

    def rows(self, name: str) -> NDArray[Any]:
        """Give the rows of a column."""
        return np.asarray(self.trace[name][self.run, : self.length])

    def decided(self, name: str) -> NDArray[Any]:
        """Give the rows at which something was decided: all but the last."""
        return self.rows(name)[:-1]

    def acceleration(self) -> NDArray[np.float64]:
        """Give the acceleration of the acting command, where something was decided [m/s²]."""
        return np.asarray(self.decided("command")[:, 0])

    def violates(self) -> Bools:
        """Tell at which rows the ego touches something or is beside the road."""
        return np.asarray((self.rows("contact") >= 0) | ~self._on_road()[: self.length])

    def _on_road(self) -> Bools:
        """Tell at which rows the centre of the ego is on the road."""
        part = slice(self.run, self.run + 1)
        places: Floats = np.asarray(self.trace["ego_place"][part], dtype=np.float64)
        marks: Bools = on_road(self.trace.layout.context.road.of(part), places)[0]
        return marks

    def safe_from(self) -> int | None:
        """Find the row from which the ego is in a safe state to the end."""
        one, columns = self.trace, dict[str, Any](self.trace.columns)
        part = slice(self.run, self.run + 1)
        row = int(
            safe_from(
                one.length[part],
                columns["ego"][part, :, EGO_SPEED],
                columns["ego_place"][part, :, PLACE_D],
                columns["contact"][part],
                self._on_road()[np.newaxis],
                STANDSTILL_SPEED,
            )[0]
        )
        return row if 0 <= row < self.length else None


def violation_s(trace: Trace, run: int) -> float | None:
    """Give the time of the first violation of a run [s], see ``Timeline``; None without."""
    return _at(trace.time, _first(_View(trace, run).violates(), 0))


def _own_alarms(view: _View, other: _View) -> Bools:
    """Tell at which rows something is detected that the twin does not have then."""
    monitors = view.trace.layout.monitors
    own, theirs = (
        alarms(of.decided("monitors"), of.decided("reason"), monitors) for of in (view, other)
    )
    return np.asarray((own & ~_padded(theirs, len(own))).any(axis=1))


def _padded(flags: Bools, rows: int) -> Bools:
    """Cut or fill up with False to a number of rows: a run that has ended has nothing."""
    out = np.zeros((rows, *flags.shape[1:]), dtype=np.bool_)
    shared = min(rows, len(flags))
    out[:shared] = flags[:shared]
    return out


def _departure(view: _View, other: _View, names: tuple[str, ...], onset: int) -> int | None:
    """Find the first row from the onset at which some columns are not bit for bit the twin's."""
    shared = min(view.length, other.length)
    found = [shared] if view.length != other.length else []
    for name in names:
        if name in DRAWN or name == "fault_active":
            continue
        # The last row of a run has no decision, whatever the other goes on to decide there.
        end = shared - 1 if name in _DECIDED else shared
        one, two = (
            np.ascontiguousarray(item.rows(name)[onset:end]).view(np.uint8).reshape(end - onset, -1)
            for item in (view, other)
        )
        differs = np.flatnonzero((one != two).any(axis=1))
        if len(differs):
            found.append(onset + int(differs[0]))
    row = min(found, default=None)
    return None if row is None else min(row, view.length - 1)


def _first(flags: Bools, onset: int) -> int | None:
    found = np.flatnonzero(flags[onset:])
    return onset + int(found[0]) if len(found) else None


def _at(time: NDArray[np.float64], row: int | None) -> float | None:
    return None if row is None else float(time[row])


# --- Injected faults counted: what became of each, by scenario, fault entry and architecture ------

CONFIDENCE: Final = 0.95
_DETECTED: Final = ("detected_in_time", "detected_late")
_FROM_WORST: Final = (
    "undetected_violation",
    "detected_late",
    "undetected_no_violation",
    "detected_in_time",
    "masked",
    "not_activated",
)


@dataclass(frozen=True)
class Injection:
    """What became of the faults of one run.

    Attributes:
        run: Result digest.
        scenario: Id in the ODD.
        architecture: Id.
        fault_entry: A fault's id, or ids joined by ``+``.
        times: Of the run.
        without_mechanism: Of its twin in which the default channel acts throughout.
        fault_free_violation_s: When that twin violates without faults too [s]: then the FTTI is not
            the fault's doing; None if it does not.
        class_: What became of the faults.
        twins: Trace digests of the fault-free twin, of the one in which the default channel acts
            throughout, and of the one that is both.
        failed: Which channels failed in a twin and not in the run; empty for none.
    """

    run: str
    scenario: str
    architecture: str
    fault_entry: str
    times: Timeline
    without_mechanism: Timeline
    fault_free_violation_s: float | None
    class_: InjectionClass
    twins: tuple[str, ...] = ()
    failed: str = ""

    @property
    def ftti_s(self) -> float | None:
        """Measured fault-tolerant time interval [s]; None where nothing is violated without."""
        return self.without_mechanism.fault_to_violation_s

    @property
    def attributed_ftti_s(self) -> float | None:
        """The FTTI [s]; None where its twin violates without faults, too."""
        return self.ftti_s if self.fault_free_violation_s is None else None

    @property
    def margin_s(self) -> float | None:
        """FTTI minus FHTI [s]; None where one of them is not there."""
        if self.ftti_s is None or self.times.fhti_s is None:
            return None
        return self.ftti_s - self.times.fhti_s


@dataclass(frozen=True)
class InjectionCount:
    """Injections of one fault entry in one scenario and architecture.

    Attributes:
        scenario: Id in the ODD.
        architecture: Id.
        fault_entry: A fault's id, or ids joined by ``+``.
        counts: Runs by class.
        detected: Detected ones of the activated.
        activated: All but those that were not activated.
        coverage: Interval of the share that is detected; None unless the points of the scenario
            are a random sample.
        least_ftti_s: The least FTTI that was measured and is the fault's doing [s]; None where
            none was.
        most_fhti_s: The largest FHTI [s]; None where none was.
    """

    scenario: str
    architecture: str
    fault_entry: str
    counts: Mapping[InjectionClass, int]
    detected: int
    activated: int
    coverage: Interval | None
    least_ftti_s: float | None
    most_fhti_s: float | None


def grouped(found: Iterable[Injection]) -> list[list[Injection]]:
    """Group injections by scenario, fault entry and architecture, in that order."""
    groups: dict[tuple[str, str, str], list[Injection]] = defaultdict(list)
    for item in found:
        groups[item.scenario, item.fault_entry, item.architecture].append(item)
    return [group for _, group in sorted(groups.items())]


def tabulate(
    found: Iterable[Injection], is_sample: Callable[[str], bool]
) -> tuple[InjectionCount, ...]:
    """Count injections by scenario, fault entry and architecture.

    Args:
        found: The injections.
        is_sample: Tells of a scenario whether its points are a random sample.
    """
    return tuple(
        count_injections(group, is_sample=is_sample(group[0].scenario)) for group in grouped(found)
    )


def count_injections(group: Sequence[Injection], *, is_sample: bool) -> InjectionCount:
    """Count the injections of one group.

    Args:
        group: All of one fault entry, scenario and architecture, at least one.
        is_sample: Whether their points are a random sample.
    """
    counted = Counter(item.class_ for item in group)
    activated = len(group) - counted["not_activated"]
    detected = sum(counted[name] for name in _DETECTED)
    interval = wilson(detected, activated, CONFIDENCE) if is_sample and activated else None
    measured = [item.attributed_ftti_s for item in group if item.attributed_ftti_s is not None]
    handled = [item.times.fhti_s for item in group if item.times.fhti_s is not None]
    return InjectionCount(
        scenario=group[0].scenario,
        architecture=group[0].architecture,
        fault_entry=group[0].fault_entry,
        counts={name: counted[name] for name in CLASSES},
        detected=detected,
        activated=activated,
        coverage=interval,
        least_ftti_s=min(measured, default=None),
        most_fhti_s=max(handled, default=None),
    )


def worst_of(group: Sequence[Injection]) -> Injection:
    """Choose the injection that is worst: by class, least margin, largest FHTI, then run."""

    def badness(item: Injection) -> tuple[float, float, float, str]:
        margin = math.inf if item.margin_s is None else item.margin_s
        fhti = item.times.fhti_s
        slowest = math.inf if fhti is None else -fhti
        return _FROM_WORST.index(item.class_), margin, slowest, item.run

    return min(group, key=badness)
