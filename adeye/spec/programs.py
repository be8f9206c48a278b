"""Programs that run beside adeye, and when they are stopped; FMUs, and how they are stepped."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Final, Literal

from pydantic import Field, StringConstraints

from adeye.spec import quantity as q
from adeye.spec.document import Problem, finds
from adeye.units import Dimension


class ProcessLimits(q.Record):
    """What the system stops a program at."""

    cpu_time: Annotated[q.Duration, Field(ge=1.0)] = 120.0
    """Processor time that it may use in a run, in whole seconds."""
    memory_mib: Annotated[int, Field(ge=16, le=1_048_576)] = 2048
    """Address space [MiB]. Some language runtimes reserve far more than they use."""
    file_mib: Annotated[int, Field(ge=1, le=65_536)] = 16
    """Of every file that it writes [MiB]."""
    open_files: Annotated[int, Field(ge=8, le=4096)] = 64
    processes: Annotated[int, Field(ge=1, le=256)] = 16
    """Processes at once, with itself."""


class Deadlines(q.Record):
    """How long who decides may take."""

    start_deadline: Annotated[q.Duration, Field(gt=0.0)] = 10.0
    """Longest that it may take to its first line, by the wall clock [s]."""
    step_deadline: Annotated[q.Duration, Field(gt=0.0)] = 2.0
    """Longest that it may take to a command, by the wall clock [s]; it only stops what hangs."""
    run_deadline: Annotated[q.Duration, Field(gt=0.0)] = 300.0
    """Longest that it may keep its run waiting in all, by the wall clock [s]."""

    def of_answer(self, *, begins: bool) -> float:
        """Return how long an answer may take [s].

        Args:
            begins: Whether who answers may begin with this one only: an FMU initialises itself
                then, and a node connects.
        """
        step: float = self.step_deadline
        return max(self.start_deadline, step) if begins else step


class ProgramParameters(Deadlines):
    """A program that decides: when it is stopped."""

    limits: ProcessLimits = ProcessLimits()


FmuPath = Annotated[str, StringConstraints(pattern=q.FMU, max_length=1000)]
VariableName = Annotated[str, StringConstraints(min_length=1, max_length=1000)]
"""Of an FMU, as its model description has it."""


class FmuUse(ProgramParameters):
    """An FMU for co-simulation, of FMI 2.0 or 3.0, and how it is stepped."""

    file: FmuPath
    """Path relative to this file; its content is part of a result's identity."""
    start: q.Free = {}
    """Start values by variable, in the unit that the variable has."""
    limits: ProcessLimits = ProcessLimits(file_mib=256)
    sub_steps: Annotated[int, Field(ge=1, le=1000)] = 1
    """How many steps of the FMU a step of the master is."""

    def __hash__(self) -> int:
        """Hash what can be: dictionaries cannot."""
        return hash((type(self), self.file))


class PlantPose(q.Record):
    """Which start values of an FMU say where a run begins."""

    x: VariableName
    """[m]"""
    y: VariableName
    heading: VariableName
    """[rad]"""
    speed: VariableName
    """[m/s]"""


class PlantState(q.SparseRecord):
    """Which outputs of an FMU are the state of the vehicle."""

    x: VariableName
    """Of the point half-way between the axles, in the map [m]."""
    y: VariableName
    heading: VariableName
    """[rad]"""
    speed: VariableName
    """[m/s]"""
    acceleration: VariableName | None = None
    """[m/s²]; where it is left out, the change of the speed is."""
    steering_angle: VariableName | None = None
    """Of the front wheels [rad]; where it is left out, the one that is commanded is."""
    yaw_rate: VariableName | None = None
    """[rad/s]; where it is left out, the change of the heading is."""


PlantInput = Literal["acceleration", "steering_angle", "friction"]


class Plant(FmuUse):
    """An FMU that moves the vehicle instead of the built-in model."""

    inputs: dict[VariableName, PlantInput]
    """What each input variable gets: the acting command, in which a grade is allowed for, and the
    friction of the tyres. They are set before the step to the next tick."""
    initial: PlantPose
    outputs: PlantState

    @finds
    def _is_commanded(self) -> Iterator[Problem]:
        for name in ("acceleration", "steering_angle"):
            if name not in self.inputs.values():
                yield ("inputs",), f"no variable gets {name}"


OBJECT_SIGNALS: Final[Mapping[str, Dimension]] = {
    "present": Dimension.NONE,
    "x": Dimension.LENGTH,
    "y": Dimension.LENGTH,
    "vx": Dimension.SPEED,
    "vy": Dimension.SPEED,
    "length": Dimension.LENGTH,
    "width": Dimension.LENGTH,
}
"""What is told of each of the eight nearest objects, in that order."""

LEAD_SIGNALS: Final[Mapping[str, Dimension]] = {
    "present": Dimension.NONE,
    "gap": Dimension.LENGTH,
    "speed": Dimension.SPEED,
}
"""What is told of the nearest object in the path of a lane."""

NEAREST: Final = 8

OWN_SIGNALS: Final[Mapping[str, Dimension]] = {
    "speed": Dimension.SPEED,
    "acceleration": Dimension.ACCELERATION,
    "heading": Dimension.ANGLE,
    "lane_offset": Dimension.LENGTH,
    "curvature": Dimension.CURVATURE,
    "desired_speed": Dimension.SPEED,
}
"""What the driver of an actor knows of its own vehicle."""

DRIVER_SIGNALS: Final[Mapping[str, Dimension]] = {
    "time": Dimension.TIME,
    **{f"own.{name}": dimension for name, dimension in OWN_SIGNALS.items()},
    **{f"lead.{name}": dimension for name, dimension in LEAD_SIGNALS.items()},
    **{
        f"objects.{number}.{name}": dimension
        for number in range(1, NEAREST + 1)
        for name, dimension in OBJECT_SIGNALS.items()
    },
}
"""What the FMU that drives an actor can be told, and what each signal measures."""
