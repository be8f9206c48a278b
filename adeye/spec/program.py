"""Programs and FMUs that decide for a part of an architecture: which, and when they are stopped."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, StringConstraints

from adeye.spec import quantity as q


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


class ProgramParameters(q.Record):
    """A program that decides for a channel: when it is stopped."""

    start_deadline: Annotated[q.Duration, Field(gt=0.0)] = 10.0
    """Longest that it may take to its first line, by the wall clock [s]."""
    step_deadline: Annotated[q.Duration, Field(gt=0.0)] = 2.0
    """Longest that it may take to a command, by the wall clock [s]; it only stops what hangs."""
    run_deadline: Annotated[q.Duration, Field(gt=0.0)] = 300.0
    """Longest that it may keep its run waiting in all, by the wall clock [s]."""
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
    sub_steps: Annotated[int, Field(ge=1, le=1000)] = 1
    """How many steps of the FMU a step of the master is."""
