"""What code from outside may use: the protocols of its parts, and what helps to write them.

Sensors, channels, switch, traffic, metrics and executors implement a protocol of this module;
nothing deeper of adeye is meant for them. Every part but the executor works on a batch of B runs in
lockstep. It is built from its spec records (one per run, because values may vary inside a batch),
reset once, and then called tick by tick. A run's result must not depend on the other runs of its
batch.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar, runtime_checkable

from pydantic import BaseModel, ConfigDict

from adeye.delivery import Delivery, SensorContext, no_measurement, sample_at
from adeye.errors import UsageError
from adeye.kernel import elementary
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled
from adeye.kernel.random import normal, uniform
from adeye.signals import (
    DEGRADED,
    DETECTION_CLASS,
    DETECTION_COLUMNS,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_LENGTH,
    DETECTION_RANGE_RATE,
    DETECTION_WIDTH,
    DETECTION_X,
    DETECTION_Y,
    EGO_ACCELERATION,
    EGO_COLUMNS,
    EGO_HEADING,
    EGO_SPEED,
    EGO_STEERING,
    EGO_X,
    EGO_Y,
    EGO_YAW_RATE,
    ESTIMATE_COLUMNS,
    ESTIMATE_PLACE,
    FAULT,
    OBJECT_ACCELERATION,
    OBJECT_CLASSES,
    OBJECT_COLUMNS,
    OBJECT_HEADING,
    OBJECT_SPEED,
    OBJECT_X,
    OBJECT_Y,
    OK,
    PLACE_COLUMNS,
    PLACE_CURVATURE,
    PLACE_D,
    PLACE_HEADING,
    PLACE_LANE,
    PLACE_OFFSET,
    PLACE_S,
    REQUESTS_AUTHORITY,
    SILENT,
    STATUS_LABELS,
    ControlCommand,
    Measurement,
    Observation,
    Scene,
    SceneContext,
)
from adeye.trace import Trace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from adeye.signals import Authority, Bools, Floats, Ints, RoadMap, SwitchFaults
    from adeye.spec.architecture import Switch, Vehicle
    from adeye.sweep.case import TestCase

__all__ = [
    "DEGRADED",
    "DETECTION_CLASS",
    "DETECTION_COLUMNS",
    "DETECTION_HAS_RANGE_RATE",
    "DETECTION_LENGTH",
    "DETECTION_RANGE_RATE",
    "DETECTION_WIDTH",
    "DETECTION_X",
    "DETECTION_Y",
    "EGO_ACCELERATION",
    "EGO_COLUMNS",
    "EGO_HEADING",
    "EGO_SPEED",
    "EGO_STEERING",
    "EGO_X",
    "EGO_Y",
    "EGO_YAW_RATE",
    "ESTIMATE_COLUMNS",
    "ESTIMATE_PLACE",
    "FAULT",
    "OBJECT_ACCELERATION",
    "OBJECT_CLASSES",
    "OBJECT_COLUMNS",
    "OBJECT_HEADING",
    "OBJECT_SPEED",
    "OBJECT_X",
    "OBJECT_Y",
    "OK",
    "PLACE_COLUMNS",
    "PLACE_CURVATURE",
    "PLACE_D",
    "PLACE_HEADING",
    "PLACE_LANE",
    "PLACE_OFFSET",
    "PLACE_S",
    "REQUESTS_AUTHORITY",
    "SILENT",
    "STATUS_LABELS",
    "ChannelContext",
    "ControlChannel",
    "ControlCommand",
    "Delivery",
    "Done",
    "Executor",
    "ExecutorContext",
    "FaultInjector",
    "HookedChannel",
    "LinkedCommand",
    "Measurement",
    "Metric",
    "MetricColumn",
    "Observation",
    "Parameters",
    "ScalarAct",
    "ScalarCommand",
    "ScalarContext",
    "ScalarFactory",
    "ScalarMeasurement",
    "ScalarObservation",
    "ScalarRoad",
    "Scene",
    "SceneContext",
    "SensorContext",
    "SensorModel",
    "SwitchContext",
    "SwitchModel",
    "Trace",
    "TrafficBackend",
    "UsageError",
    "compiled",
    "elementary",
    "no_measurement",
    "normal",
    "sample_at",
    "sin_cos",
    "uniform",
]

Task = TypeVar("Task")
Result = TypeVar("Result")


class Parameters(BaseModel):
    """Base of a plug-in's parameter model: frozen, unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class SensorModel(Protocol):
    """A sensor: ground truth in, its newest delivered measurement out."""

    def sense(self, scene: Scene) -> Measurement:
        """Sample if its clock says so, and return what is delivered at this tick."""
        ...


@dataclass(frozen=True, slots=True)
class ChannelContext:
    """What a channel is built with; it holds nothing that is not known before the drive.

    Attributes:
        channel_id: Its name in the architecture.
        parameters: (B) its parameter record in each run.
        links: Ids of what is linked to it, in the architecture's order.
        sensors: Kind of each linked sensor, by id.
        mounts: (B, 4) x, y, z, yaw of each linked sensor that has a mount, by id.
        vehicles: (B) the vehicle record in each run.
        road: The map.
        desired_speed: (B) speed that the ego is asked to drive [m/s].
        step: Master clock [s].
        period: Time between two of its ticks [s].
        shows_candidates: Whether somebody looks at what a command tells for pictures; otherwise a
            channel may leave that out, which saves time and changes nothing else.
        data_sheets: What the data sheet of each linked sensor says that has one, by id: columns
            (B,) by field, see ``simulate.sensors.rig.DATA_SHEETS``.
        models: What makes the samples of each linked sensor, by id: its kind with its fidelity, see
            ``spec.sensors.model_name``; where it is missing, its kind.
    """

    channel_id: str
    parameters: Sequence[Any]
    links: tuple[str, ...]
    sensors: Mapping[str, str]
    mounts: Mapping[str, Floats]
    vehicles: Sequence[Vehicle]
    road: RoadMap
    desired_speed: Floats
    step: float
    period: float
    shows_candidates: bool = True
    data_sheets: Mapping[str, Mapping[str, Floats]] = field(default_factory=dict)
    models: Mapping[str, str] = field(default_factory=dict)

    @property
    def runs(self) -> int:
        """Number of runs B in the batch."""
        return len(self.vehicles)


@runtime_checkable
class ControlChannel(Protocol):
    """An independent controller of the ego, working on the batch."""

    monitor_ids: tuple[str, ...]
    """Names of its monitors, in the order of ``ControlCommand.monitors``; may be empty."""

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        ...

    def act(self, observation: Observation) -> ControlCommand:
        """Answer one observation with one command per run."""
        ...


@runtime_checkable
class HookedChannel(Protocol):
    """A channel that lets faults into itself; to offer hooks is up to the channel.

    A fault with the target ``hooks.<channel>`` is told to ``inject`` before ``act``, at its onset
    and whenever it comes or goes in a run, and in no other case: a channel without such a fault
    hears nothing and must behave as if it had no hooks. The channel's ``reset`` clears everything.
    """

    hooks: tuple[str, ...]
    """Models of faults that it offers a hook for, such as ``planner_frozen``."""

    def inject(self, hook: str, active: Bools, size: Floats) -> None:
        """Take in where a fault is present from now on.

        Args:
            hook: Which of ``hooks``.
            active: (B,) runs in which it is present; the others must keep every bit.
            size: (B,) how large it is, in the unit of its model: the offset of ``map_shifted`` [m],
                1 for a model without a size.
        """
        ...


# --- One object per run as a channel: the simplest way to write one -------------------------------


@dataclass(frozen=True, slots=True)
class ScalarRoad:
    """The road of one run.

    Attributes:
        segments: Reference line, the right edge (K, 5): x, y, heading, length, curvature.
        lane_width: [m].
        lanes: Number of lanes.
        shoulder: Width beside the right edge [m].
        speed_limit: [m/s].
        verge: Width of free ground beside the shoulder [m].
        refuges: Parking bays and rest areas (R, 5), see ``signals.REFUGE_COLUMNS``.
        slabs: Of an imported road, (S, 4), see ``kernel.strips``; else None. What is said above of
            lanes, shoulder and limit is then a summary: most lanes, mean width, least limit.
        strips: (J, 8).
        left_hand: Whether traffic keeps to the left. All that a channel is told and answers is then
            of the mirror image, in which it keeps to the right.
    """

    segments: Floats
    lane_width: float
    lanes: int
    shoulder: float
    speed_limit: float
    verge: float
    refuges: Floats
    slabs: Floats | None = None
    strips: Floats | None = None
    left_hand: bool = False


@dataclass(frozen=True, slots=True)
class ScalarContext:
    """What the channel object of one run is built with.

    Attributes:
        channel_id: Its name in the architecture.
        links: Ids of what is linked to it.
        sensors: Kind of each linked sensor, by id.
        mounts: (4,) x, y, z, yaw of each linked sensor that has a mount, by id.
        vehicle: The ego.
        road: The map.
        desired_speed: Speed that the ego is asked to drive [m/s].
        step: Master clock [s].
        period: Time between two of its ticks [s].
    """

    channel_id: str
    links: tuple[str, ...]
    sensors: Mapping[str, str]
    mounts: Mapping[str, Floats]
    vehicle: Vehicle
    road: ScalarRoad
    desired_speed: float
    step: float
    period: float


@dataclass(frozen=True, slots=True)
class ScalarMeasurement:
    """The newest sample of one sensor in one run.

    Attributes:
        stamp: Time of the sample [s], -1 before the first.
        fresh: Whether it was delivered at this tick.
        alive: Whether the sensor delivers at all.
        detections: (N, 7) of the objects that it sees, see ``signals.DETECTION_COLUMNS``.
        estimate: (13,) ego estimate, see ``signals.ESTIMATE_COLUMNS``, or None.
        values: (V,) of a sensor of the ego's motion, see ``signals.GNSS_COLUMNS`` and
            ``signals.IMU_COLUMNS``, or None.
    """

    stamp: float
    fresh: bool
    alive: bool
    detections: Floats
    estimate: Floats | None
    values: Floats | None = None


@dataclass(frozen=True, slots=True)
class ScalarCommand:
    """What the channel object of one run wants the ego to do.

    Attributes:
        acceleration: [m/s²].
        steering_angle: [rad].
        status: Index into ``signals.STATUS_LABELS``.
    """

    acceleration: float
    steering_angle: float
    status: int = OK


@dataclass(frozen=True, slots=True)
class LinkedCommand:
    """The command of a linked channel at the previous tick.

    Attributes:
        acceleration: [m/s²].
        steering_angle: [rad].
        stamp: Time of the observation that it answers [s], -1 before the first.
        status: Index into ``signals.STATUS_LABELS``.
    """

    acceleration: float
    steering_angle: float
    stamp: float
    status: int


@dataclass(frozen=True, slots=True)
class ScalarObservation:
    """What is linked to the channel object of one run.

    Attributes:
        time: [s].
        measurements: Linked sensors by id.
        commands: Linked channels by id: their command of the previous tick.
        authority: Index of the acting channel at the previous tick, if the switch is linked.
        reason: Why it acts, index into ``signals.REASON_LABELS``, if the switch is linked.
    """

    time: float
    measurements: Mapping[str, ScalarMeasurement]
    commands: Mapping[str, LinkedCommand]
    authority: int | None
    reason: int | None


class ScalarAct(Protocol):
    """The channel object of one run."""

    def act(self, observation: ScalarObservation, /) -> ScalarCommand | tuple[float, float]:
        """Answer one observation."""
        ...


class ScalarFactory(Protocol):
    """A class of channel objects."""

    def __call__(self, parameters: Any, context: ScalarContext, /) -> ScalarAct:
        """Make the object of one run."""
        ...


class SwitchModel(Protocol):
    """Decides whose command acts."""

    def arbitrate(
        self,
        time: float,
        proposals: Sequence[ControlCommand],
        faults: SwitchFaults | None = None,
    ) -> tuple[Floats, Authority]:
        """Return the acting command (B, 2) and who has authority, why.

        Args:
            time: Of this tick [s].
            proposals: Newest command of every channel, in the architecture's order.
            faults: What is wrong with the switch itself at this tick; None for nothing.
        """
        ...


@dataclass(frozen=True, slots=True)
class SwitchContext:
    """What a switch is built with.

    Attributes:
        specs: (B) its spec record in each run.
        channels: Channel ids in the architecture's order; authority indexes into them.
        step: Master clock [s].
    """

    specs: Sequence[Switch]
    channels: tuple[str, ...]
    step: float


class TrafficBackend(Protocol):
    """The simulated world of a batch: the ego, the other actors, contact and the end of runs."""

    name: str
    variant: str

    def reset(self, cases: Sequence[TestCase]) -> tuple[SceneContext, Scene]:
        """Build the world of each test case; all have one structure."""
        ...

    def step(self, command: Floats, friction: Floats | None = None) -> Scene:
        """Advance one tick with the acting command (B, 2) and return the next scene.

        Args:
            command: (B, 2) acceleration [m/s²] and steering angle [rad].
            friction: (B,) of the ego's tyres; None for that of the road.
        """
        ...


@dataclass(frozen=True, slots=True)
class MetricColumn:
    """A metric of B runs.

    Attributes:
        value: (B,) in the metric's unit; beside ``incomplete`` how bad it is at least, or NaN; of
            the other statuses meaningless.
        status: (B,) words: value, no_conflict, not_applicable, undefined, incomplete, error.
        time: (B,) time of the worst case [s], NaN if there is none.
        actor: (B,) object index of the worst case, -1 if there is none.
    """

    value: Floats
    status: Sequence[str]
    time: Floats
    actor: Sequence[int] | Ints


class Metric(Protocol):
    """A number that a trace is summarised by."""

    uid: str
    unit: str
    worse: str
    source: str

    def compute(self, trace: Trace) -> MetricColumn:
        """Return one value per run, with the time and the actor of the worst case."""
        ...


class FaultInjector(Protocol):
    """Wraps the ports; the identity, bit for bit, while no fault is active."""

    def update(self, scene: Scene) -> Bools:
        """Decide which faults are active at this tick (B, F)."""
        ...


@dataclass(frozen=True, slots=True)
class Done(Generic[Task, Result]):
    """A batch that has been executed.

    Attributes:
        task: What was submitted.
        result: What came back, None if its worker died.
        lost: How the worker died, empty otherwise.
    """

    task: Task
    result: Result | None
    lost: str = ""


@dataclass(frozen=True, slots=True)
class ExecutorContext(Generic[Task, Result]):
    """What an executor is built with.

    Attributes:
        work: Importable function from task to result. Tasks and results can be pickled.
        workers: How many tasks are executed at once, as the user asked; None for its own choice.
        address: Where its scheduler is, as the user wrote it; empty for nowhere.
    """

    work: Callable[[Task], Result]
    workers: int | None = None
    address: str = ""


class Executor(Protocol[Task, Result]):
    """Where batches are executed; it never decides what is, and writes no result anywhere.

    It is built with an ``ExecutorContext``; ``adeye.testing.check_executor`` tries what it must do.
    """

    def run(self, tasks: Iterator[Task]) -> Iterator[Done[Task, Result]]:
        """Execute tasks as they come; results arrive in any order, each once.

        A task is asked for in the caller's thread and only when it can soon be executed: whoever
        asks for it holds it. After the last one has been given and executed the iterator is asked
        again, because what was lost may come back. An exception of the work is raised here.

        Raises:
            PlatformError: Nothing can be executed any more.
        """
        ...

    def close(self) -> None:
        """Drop what was not begun, end what was started; may be called twice, and while it runs."""
        ...
