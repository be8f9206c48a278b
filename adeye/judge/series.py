"""Metric series: what an FSR may say about every sample of a run, measured once per trace."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar

import numpy as np

from adeye.judge import conflict
from adeye.judge.following import LATEST, MTTC, TTR, following_series
from adeye.judge.outcome import abilities
from adeye.judge.stl.series import SampleStatus, declared_series
from adeye.kernel.jit import compiled, inlined
from adeye.signals import EGO_ACCELERATION, Bools, Bytes, Floats, Ints, Shorts, SignalType

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from adeye.judge.stl.series import Series
    from adeye.trace import Trace


T = TypeVar("T")

# --- Samples of a series with their status: what a value of a conflict stands for -----------------

_VALUE: Final = int(SampleStatus.VALUE)
_FREE: Final = int(SampleStatus.NO_CONFLICT)
_NOT_APPLICABLE: Final = int(SampleStatus.NOT_APPLICABLE)
_ERROR: Final = int(SampleStatus.ERROR)


@dataclass(frozen=True, slots=True)
class Samples:
    """A series of B runs with what is known about each sample.

    Attributes:
        values: (B, T) [unit of the series]; arbitrary where the status is not VALUE.
        status: (B, T) ``SampleStatus``.
        actor: (B, T) object of the worst case, -1 for none.
    """

    values: Floats
    status: Bytes
    actor: NDArray[np.integer[Any]]


def is_demand(column: int) -> bool:
    """Tell whether a quantity of ``conflict`` is a deceleration, worse when larger."""
    return column in {conflict.DRAC, conflict.REQUIRED}


@inlined
def status_of(value: float, actor: int, touched: int, demands: bool) -> int:  # noqa: FBT001
    """Tell what a value of a conflict stands for.

    Args:
        value: +inf for no conflict; of a deceleration: for one that nothing can reach.
        actor: Object of the worst case, -1 for none.
        touched: Object that the ego touches, -1 for none.
        demands: Whether it is a deceleration.
    """
    status = _VALUE
    if not math.isfinite(value):
        status = _ERROR
        if value == math.inf and not demands:
            status = _FREE
        elif value == math.inf and touched >= 0:
            # No deceleration undoes a contact.
            status = _NOT_APPLICABLE
        elif value == math.inf and actor < 0:
            status = _FREE
    elif demands and actor < 0:
        status = _FREE
    return status


@compiled
def fill_statuses(
    length: Ints,
    values: Floats,
    actors: Shorts,
    contact: Shorts,
    demands: bool,  # noqa: FBT001 - compiled
    status: Bytes,
) -> None:
    """Tell what each value (B, T) of a conflict stands for, within its run."""
    for run in range(values.shape[0]):
        for row in range(length[run]):
            status[run, row] = status_of(
                values[run, row], actors[run, row], contact[run, row], demands
            )
        for row in range(length[run], values.shape[1]):
            status[run, row] = _FREE if demands else _VALUE


@compiled
def mark_errors(numbers: Floats, status: Bytes) -> None:
    """Make an error of each sample (B, T) whose number is not finite."""
    for run in range(numbers.shape[0]):
        for row in range(numbers.shape[1]):
            if not math.isfinite(numbers[run, row]):
                status[run, row] = _ERROR


@compiled
def mark_undecided(length: Ints, status: Bytes) -> None:
    """Say that a sample (B, T) does not apply from the last row of its run on."""
    for run in range(length.shape[0]):
        for row in range(length[run] - 1, status.shape[1]):
            status[run, row] = _NOT_APPLICABLE


# --- Metric series: what an FSR may say about every sample of a run, measured once per trace ------


@dataclass(frozen=True, slots=True)
class RssParameters:
    """Assumptions of responsibility-sensitive safety about ego and others.

    Source:
        Starting values of the ad-rss library; IEEE 2846-2022 lists what each user must decide.
    """

    response_time: float = 1.0
    """Of the ego [s]."""
    other_response_time: float = 2.0
    """Of others, for the lateral distance [s]."""
    max_acceleration: float = 3.5
    """While responding [m/s²]."""
    min_braking: float = 4.0
    """Of who follows or comes towards the ego [m/s²]."""
    max_braking: float = 8.0
    """Of who drives ahead [m/s²]."""
    min_correct_braking: float = 3.0
    """Of the ego towards oncoming traffic [m/s²]."""
    lateral_acceleration: float = 0.2
    """Towards each other, while responding [m/s²]."""
    lateral_braking: float = 0.8
    """[m/s²]."""
    fluctuation: float = 0.1
    """Swaying in the lane [m]."""
    least_distance: float = 0.0
    """Along the road, in addition [m]."""
    fastest: float = math.inf
    """Up to which speed both accelerate while responding [m/s]."""
    is_printed: bool = False
    """Whether the lateral distance is that of definition 6 as printed, not that of ad-rss."""


_DEFAULT_RSS: Final = np.array(astuple(RssParameters()))


@dataclass(frozen=True, slots=True)
class SeriesDefinition:
    """A metric series.

    Attributes:
        name: As formulas call it.
        type: Unit, scale, kind, text and, where it declares "no conflict", the cap.
        worse: ``lower`` or ``higher``: direction of danger.
        source: Publication or standard.
        uid: Changes whenever the definition does.
    """

    name: str
    type: SignalType
    worse: Literal["lower", "higher"]
    source: str
    uid: str


class TraceSeries:
    """The metric series of a trace; each is measured when it is first asked for.

    Attributes:
        trace: The runs.
        step: Time between two rows [s].
        kept: What metrics have read for each other, by name.
    """

    def __init__(self, trace: Trace, rss: RssParameters | None = None) -> None:
        """Prepare the series of a trace.

        Args:
            trace: Of B runs.
            rss: Assumptions behind ``rss_margin`` and ``rss_violation``.
        """
        self.trace = trace
        self.step = trace.layout.context.step
        self._rss = _DEFAULT_RSS if rss is None else np.array(astuple(rss))
        self._samples: dict[str, Samples] = {}
        self.kept: dict[str, Any] = {}

    @property
    def rss_response(self) -> tuple[float, float]:
        """Response time [s] of the ego and braking [m/s²] that RSS asks of it behind another."""
        return float(self._rss[0]), float(self._rss[3])

    @cached_property
    def abilities(self) -> Floats:
        """Largest braking, lateral acceleration and acceleration (B, 3) of the egos [m/s²]."""
        return abilities(self.trace)

    @property
    def shape(self) -> tuple[int, int]:
        """Runs and rows (B, T) of every series."""
        return self.trace.runs, int(self.trace.time.shape[0])

    @cached_property
    def known(self) -> Bools:
        """(B, T) whether a row lies within its run."""
        rows = np.arange(self.shape[1])
        return np.asarray(rows < self.trace.length[:, np.newaxis])

    @cached_property
    def touched(self) -> Bools:
        """(B, T) whether the ego is in contact."""
        return np.asarray(self.known & (self.trace["contact"] >= 0))

    def column(self, name: str) -> NDArray[Any]:
        """Return a column of the trace."""
        return self.trace[name]

    def once(self, name: str, read: Callable[[], T]) -> T:
        """Return what metrics read for each other under a name; the first one reads it."""
        if name not in self.kept:
            self.kept[name] = read()
        found: T = self.kept[name]
        return found

    def samples(self, name: str) -> Samples:
        """Give the samples of a metric series.

        Raises:
            KeyError: There is no such series.
        """
        if name not in self._samples:
            self._samples[name] = _MEASURES[name](self)
        return self._samples[name]

    def series(self, name: str) -> Series:
        """Give a metric series as formulas read it.

        Raises:
            KeyError: There is no such series.
        """
        samples, declared = self.samples(name), SERIES[name].type
        status = samples.status
        if declared.cap is None:
            # Without a conflict nothing is demanded: 0 for a deceleration, false for a violation.
            free = status == SampleStatus.NO_CONFLICT
            status = np.where(free, np.int8(SampleStatus.VALUE), status)
        return declared_series(declared, samples.values, status, samples.actor)

    def object_distance(self, index: int) -> Floats:
        """Measure the body distance (B, T) to one object [m]; NaN is an error."""
        distances = np.zeros(self.shape)
        conflict.measure_object(self.scene, index, distances, np.zeros((self.trace.runs, 0)))
        return distances

    def object_gap(self, index: int) -> Floats:
        """Measure the signed gap (B, T) to one object [m]; NaN is an error."""
        gaps = np.zeros(self.shape)
        conflict.measure_object(self.scene, index, np.zeros((self.trace.runs, 0)), gaps)
        return gaps

    @cached_property
    def scene(self) -> conflict.Scene:
        """What scans read of the runs."""
        context, columns = self.trace.layout.context, self.column
        return conflict.Scene(
            length=self.trace.length,
            ego=columns("ego"),
            ego_place=columns("ego_place"),
            ego_size=context.ego_size,
            objects=columns("objects"),
            places=columns("object_places"),
            sizes=context.object_sizes,
            contact=columns("contact"),
        )

    @property
    def nearest(self) -> tuple[Floats, Shorts]:
        """Gap to the nearest object in the path (B, T) [m] and that object, -1 for none."""
        values, actors = self.worst_conflicts
        return values[conflict.GAP], actors[conflict.GAP]

    @cached_property
    def conflicts(self) -> tuple[Floats, Shorts]:
        """Values and actors (8, B, T) of ``conflict.DISTANCE`` and so on, 0 beyond the runs."""
        return self._measured(is_least_only=False)

    @cached_property
    def worst_conflicts(self) -> tuple[Floats, Shorts]:
        """The same, but of the distances only the least of each run is exact."""
        if "conflicts" in self.__dict__:
            return self.conflicts
        return self._measured(is_least_only=True)

    @cached_property
    def least_distance(self) -> Samples:
        """Samples of the distance of which only the least of each run is exact."""
        values, actors = self.worst_conflicts
        return _sampled(self, values[conflict.DISTANCE], actors[conflict.DISTANCE])

    def _measured(self, *, is_least_only: bool) -> tuple[Floats, Shorts]:
        values = np.empty((8, *self.shape))
        actors = np.empty(values.shape, dtype=np.int16)
        conflict.measure_runs(self.scene, self._rss, is_least_only, values, actors)
        return values, actors


def _conflict(column: int) -> Callable[[TraceSeries], Samples]:
    def measure(series: TraceSeries) -> Samples:
        is_whole = column == conflict.DISTANCE
        values, actors = series.conflicts if is_whole else series.worst_conflicts
        return _sampled(series, values[column], actors[column], demands=is_demand(column))

    return measure


def _sampled(
    series: TraceSeries, values: Floats, actor: Shorts, *, demands: bool = False
) -> Samples:
    status, contact = np.empty(values.shape, dtype=np.int8), series.column("contact")
    fill_statuses(series.trace.length, values, actor, contact, demands, status)
    return Samples(values, status, actor)


def _rss_violation(series: TraceSeries) -> Samples:
    margin = series.samples("rss_margin")
    is_value = margin.status == SampleStatus.VALUE
    violated = is_value & (margin.values < 0.0)
    actor = np.where(violated, margin.actor, -1)
    return Samples(violated.astype(np.float64), margin.status, actor)


def _following(quantity: int) -> Callable[[TraceSeries], Samples]:
    def measure(series: TraceSeries) -> Samples:
        values, actor = np.empty(series.shape), np.empty(series.shape, dtype=np.int16)
        following_series(series.scene, *series.nearest, series.abilities, quantity, values, actor)
        return _sampled(series, values, actor)

    return measure


CHANGE_WINDOW: Final = 1.0
"""Time over which a change of the ego's motion is averaged [s], that of ISO 15622 for jerk.

The acceleration of a stop falls to zero within a tick, and a command may jump: from one row to the
next such a change would be as large as the step is small."""


def mean_change(numbers: Floats, step: float) -> Floats:
    """Average the rate of change of a number of the ego over the window before each row.

    Before the run it counts as at the first row. Between two rows it is taken as even.

    Args:
        numbers: (B, T).
        step: Time between rows [s].

    Returns:
        (B, T) [unit of the number over s], 0 at the first row.
    """
    lag = CHANGE_WINDOW / step
    whole = int(lag + 1e-9)
    share = max(0.0, lag - whole)
    rows = np.arange(numbers.shape[1])
    before = numbers[:, np.maximum(rows - whole, 0)]
    if share > 0.0:
        before = before + share * (numbers[:, np.maximum(rows - whole - 1, 0)] - before)
    return np.asarray((numbers - before) / CHANGE_WINDOW)


def _jerk(series: TraceSeries) -> Samples:
    acceleration = series.column("ego")[..., EGO_ACCELERATION]
    values = mean_change(acceleration, series.step)
    status = np.full(values.shape, SampleStatus.VALUE, dtype=np.int8)
    status[:, 0] = SampleStatus.NOT_APPLICABLE
    status[~np.isfinite(values) | ~np.isfinite(acceleration)] = SampleStatus.ERROR
    return Samples(values, status, np.full(values.shape, -1, dtype=np.int64))


def _define(  # noqa: PLR0913, PLR0917 - a row of the table below
    name: str,
    unit: str,
    scale: float,
    cap: float | None,
    worse: Literal["lower", "higher"],
    text: str,
    source: str,
    version: int = 1,
    *,
    least: float | None = 0.0,
    of_objects: bool = True,
) -> SeriesDefinition:
    kind = "boolean" if name == "rss_violation" else "number"
    declared = SignalType(unit, scale, kind, text, cap=cap, least=least, of_objects=of_objects)
    return SeriesDefinition(name, declared, worse, source, f"adeye:series.{name}@{version}")


_IN_PATH = "the nearest object in the path ahead"
_RSS = (
    "Shalev-Shwartz et al. (2017), On a formal model of safe and scalable self-driving cars; "
    "the lateral distance as ad-rss 5.0 has it"
)
_DEFINITIONS = (
    _define(
        "distance", "m", 10.0, 100.0, "lower",
        "distance between the bodies of the ego and the nearest object; 0 in contact",
        "geometry of oriented boxes",
    ),
    _define(
        "gap", "m", 10.0, 200.0, "lower",
        f"bumper-to-bumper gap along the ego's lane, at its lateral place, to {_IN_PATH}",
        "ISO 15622, clearance",
    ),
    _define(
        "ttc", "s", 1.0, 10.0, "lower",
        "least time to collision at constant speeds with an object in the path ahead; 0 in contact",
        "Hayward (1972), Near-miss determination through use of a scale of danger",
    ),
    _define(
        "time_gap", "s", 1.0, 10.0, "lower",
        f"time in which the ego drives the gap to {_IN_PATH}",
        "ISO 15622, time gap",
    ),
    _define(
        "time_headway", "s", 1.0, 10.0, "lower",
        f"time between the front bumpers of {_IN_PATH} and of the ego passing one place",
        "Jansson (2005), Collision avoidance theory",
    ),
    _define(
        "mttc", "s", 1.0, 10.0, "lower",
        "least time to collision at constant accelerations with an object in the path",
        "Ozbay et al. (2008), Derivation and validation of a surrogate safety measure",
    ),
    _define(
        "ttr", "s", 1.0, 10.0, "lower",
        "least time that the best of braking, steering and kickdown may wait, negative when late",
        "Tamke et al. (2011), A flexible method for criticality assessment", least=LATEST,
    ),
    _define(
        "drac", "m/s²", 1.0, None, "higher",
        "largest deceleration to avoid a crash with an object in the path that keeps its speed",
        "Cooper and Ferguson (1976), Traffic studies at T-junctions",
    ),
    _define(
        "required_deceleration", "m/s²", 1.0, None, "higher",
        "largest constant deceleration needed against an object in the path that goes on braking",
        "Jansson (2005), Collision avoidance theory, 4.2",
    ),
    _define(
        "rss_margin", "m", 10.0, 100.0, "lower",
        "least gap beyond the RSS distance to an object ahead that is laterally unsafe, too",
        _RSS, 2, least=None,
    ),
    _define(
        "rss_violation", "1", 1.0, None, "higher",
        "longitudinal and lateral distance to an object ahead are both below those of RSS",
        _RSS, 2,
    ),
    _define(
        "jerk", "m/s³", 1.0, None, "higher",
        "mean change of the ego's longitudinal acceleration over the last second",
        "ISO 15622:2018, which averages jerk over 1 s", version=2, least=None,
        of_objects=False,
    ),
)  # fmt: skip

SERIES: Final = {definition.name: definition for definition in _DEFINITIONS}
"""Metric series by name."""

_MEASURES: Final[dict[str, Callable[[TraceSeries], Samples]]] = {
    "distance": _conflict(conflict.DISTANCE),
    "gap": _conflict(conflict.GAP),
    "ttc": _conflict(conflict.TTC),
    "time_gap": _conflict(conflict.TIME_GAP),
    "time_headway": _conflict(conflict.TIME_HEADWAY),
    "mttc": _following(MTTC),
    "ttr": _following(TTR),
    "drac": _conflict(conflict.DRAC),
    "required_deceleration": _conflict(conflict.REQUIRED),
    "rss_margin": _conflict(conflict.RSS_MARGIN),
    "rss_violation": _rss_violation,
    "jerk": _jerk,
}


def series_signals() -> dict[str, SignalType]:
    """List the metric series as signals, by name."""
    return {name: definition.type for name, definition in SERIES.items()}
