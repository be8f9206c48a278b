"""The closed loop: a batch of test cases in, a trace out. It never judges.

Driver ``stepwise``: tick by tick, each stage over all runs of the batch, then the next. The order
of the stages is fixed, so equal test cases give equal bits whatever stands beside them.
"""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from adeye.kernel.jit import compiler
from adeye.ports import SwitchContext
from adeye.simulate.channels.rack import ChannelRack, Watch
from adeye.simulate.faults import FaultPlan
from adeye.simulate.mirror import as_driven
from adeye.simulate.recorder import Memory, Recorder
from adeye.simulate.sensors.rig import Rig, mounts
from adeye.simulate.switch import make_switch
from adeye.simulate.switch.arbiter import overriding
from adeye.simulate.traffic import make_traffic
from adeye.simulate.world.clock import ticks
from adeye.trace import Layout, Moved, Trace

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from adeye.signals import SceneContext
    from adeye.simulate.channels.pace import Pace
    from adeye.simulate.channels.process.protocol import Witness
    from adeye.sweep.case import TestCase
    from adeye.trace import Album

DRIVER = "stepwise"
DEFAULT_BACKEND = "batch"
NUMERICS_VERSION = 8
"""Raised whenever the bits of any trace change on purpose."""


@dataclass(frozen=True, slots=True)
class EngineIdentity:
    """What a result depends on beside its test case.

    Attributes:
        backend: Name of the traffic implementation.
        variant: Arithmetic variant of it.
        numerics_version: Raised when bits change on purpose.
    """

    backend: str
    variant: str
    numerics_version: int


def identity(backend: str = DEFAULT_BACKEND, variant: str | None = None) -> EngineIdentity:
    """Name the engine that would run with a traffic backend and a variant of its arithmetic.

    Raises:
        UsageError: There is no such backend or variant.
    """
    from adeye.simulate.traffic import variant_of

    return EngineIdentity(backend, variant_of(backend, variant), NUMERICS_VERSION)


def run(  # noqa: PLR0913 - all but the cases has a default
    cases: Sequence[TestCase],
    *,
    backend: str = DEFAULT_BACKEND,
    variant: str | None = None,
    base_dirs: Mapping[str, Path] | None = None,
    drawn: bool = False,
    memory: Memory | None = None,
    on_tick: Callable[[int], None] | None = None,
    most_ticks: int | None = None,
    witness: Witness | None = None,
    album: Album | None = None,
    pace: Pace | None = None,
) -> Trace:
    """Run a batch of test cases of one structure in closed loop.

    Args:
        cases: Test cases that share scenario structure, architecture structure, faults and step.
        backend: Traffic implementation.
        variant: Its arithmetic; None for its first.
        base_dirs: Folder of the file that names plug-ins, by architecture id, and by
            ``place_key`` of a scenario that names FMUs.
        drawn: Whether to record what only pictures need, ``trace.DRAWN``; the digest is the same.
        memory: Where the trace lies; a later run with the same memory overwrites it.
        on_tick: Called after each tick with the number of runs that have ended.
        most_ticks: Stop after so many ticks, however many runs go on; None to go to the end.
        witness: Who takes down what a channel is shown in the first run.
        album: Gets the images that physical cameras take in the first run.
        pace: Keeps ticks from beginning before their time; the trace is the same with and without.

    Returns:
        The trace; its rows are in the order of the cases.
    """
    compiler()
    cases = as_driven(cases)
    first = cases[0]
    base_dir = (base_dirs or {}).get(first.architecture.architecture, Path())
    traffic = make_traffic(backend, variant)
    traffic.base_dir = base_dir
    traffic.scenario_dir = (base_dirs or {}).get(first.place_key, Path())
    context, scene = traffic.reset(cases)
    rig = Rig(cases, context, base_dir, album=album)
    rack = ChannelRack(cases, context, base_dir, watch=Watch(drawn, witness, pace))
    faults = FaultPlan(cases, context)
    channels = tuple(first.architecture.channels)
    arbitration = SwitchContext([case.architecture.switch for case in cases], channels, first.step)
    switch = overriding(make_switch(arbitration), cases, arbitration)
    scenario = first.scenario
    layout = layout_of(cases, context, rack.monitor_ids, faults.ids)
    grip = context.surroundings.friction
    last = ticks(scenario.horizon, first.step, "horizon") + ticks(scenario.tail, first.step, "tail")
    recorder = Recorder(
        layout,
        last + 1,
        tuple(case.digest for case in cases),
        drawn=drawn,
        memory=memory,
        mounts=mounts(cases),
    )
    with closing(traffic), closing(rig), closing(rack):
        while scene.running.any() and scene.tick != most_ticks:
            if pace is not None:
                pace.hold(scene.time)
            active = faults.update(scene)
            sensed = faults.on_bodies(rig, active, scene).sense(scene)
            readings = rack.detect(faults.on_readings(sensed, active, scene))
            faults.on_hooks(rack.channels, active, scene)
            answers = rack.act(scene, readings, partial(faults.on_links, active, scene))
            proposals = faults.on_commands(answers, active, scene)
            command, authority = switch.arbitrate(
                scene.time, proposals, faults.on_switch(active, scene)
            )
            rack.remember(proposals, authority)
            recorder.add(scene, readings, proposals, command, authority, active)
            scene = traffic.step(
                faults.on_actuators(command, active, scene), faults.on_tyres(grip, active, scene)
            )
            if on_tick is not None:
                on_tick(int(np.count_nonzero(~scene.running)))
        if pace is not None:
            pace.hold(scene.time)
        recorder.close(scene)
    return recorder.trace(
        horizon_row=traffic.ending.horizon_row, complete=traffic.ending.complete, events=rack.events
    )


def layout_of(
    cases: Sequence[TestCase],
    context: SceneContext,
    monitors: tuple[str, ...],
    faults: tuple[str, ...],
) -> Layout:
    """Name the axes of the trace of a batch.

    Args:
        cases: Test cases of one structure.
        context: Of their traffic.
        monitors: Ids of the monitors of their channels.
        faults: Ids of their faults.
    """
    first = cases[0]
    events, places = first.scenario.storyboard, context.object_ids.index
    return Layout(
        scenario=first.scenario_id,
        architecture=first.architecture,
        architectures=tuple(case.architecture for case in cases),
        sensors=tuple(first.architecture.sensors),
        channels=tuple(first.architecture.channels),
        monitors=monitors,
        faults=faults,
        context=context,
        horizon=first.scenario.horizon,
        tail=first.scenario.tail,
        realised=first.scenario.realised,
        moved=tuple(
            Moved(places(item.actor), along=item.is_along, across=item.is_across)
            for item in map(events.__getitem__, context.event_ids)
        ),
    )
