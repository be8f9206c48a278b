"""The channels of an architecture, built for a batch and called together at every tick."""

from __future__ import annotations

from collections import deque
from copy import deepcopy
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from adeye.ports import ChannelContext, ControlChannel
from adeye.signals import Authority, ControlCommand, Measurement, Scene, SceneContext
from adeye.simulate.channels.factory import BUILT_IN, make_channel
from adeye.simulate.channels.links import View, no_command, observe
from adeye.simulate.channels.perception.clustering import Clustering
from adeye.simulate.channels.process.protocol import Witness, WitnessedChannel
from adeye.simulate.sensors.rig import data_sheets, mounts
from adeye.simulate.world.clock import period_ticks, ticks
from adeye.simulate.world.compile import ego_desired_speeds
from adeye.spec.sensors import PhysicalLidar, model_name

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence
    from pathlib import Path

    from adeye.signals import Observation
    from adeye.simulate.channels.pace import Pace
    from adeye.sweep.case import TestCase
    from adeye.trace import ChannelEvent

# --- The cadence of a channel: it acts at its own rate, and its command arrives after its delay ---


class ClockedChannel:
    """Holds a channel's newest command between its ticks and releases each one late.

    The stamp of a command is the time of the observation that it answers, so its age counts the
    delay and the time that it has been held.
    """

    def __init__(self, channel: ControlChannel, every: int, delay: int) -> None:
        """Wrap a channel.

        Args:
            channel: The channel.
            every: Ticks between two of its own ticks, at least 1.
            delay: Compute time: ticks from an observation to the command's release.
        """
        self._channel = channel
        self._every = every
        self._delay = delay
        self.monitor_ids: tuple[str, ...] = tuple(channel.monitor_ids)
        self._tick = 0
        self._waiting: deque[tuple[int, ControlCommand]] = deque()
        self._newest = no_command("", 0)

    @property
    def is_due(self) -> bool:
        """Whether the channel acts at the coming tick, so that it needs an observation."""
        return self._tick % self._every == 0

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        self._tick = 0
        self._waiting.clear()
        self._newest = no_command(context.channel_id, context.runs)
        if self.monitor_ids:
            shape = (context.runs, len(self.monitor_ids), 2)
            self._newest.monitors = np.zeros(shape, dtype=np.bool_)
        self._channel.reset(context)

    def act(self, observation: Observation | None) -> ControlCommand:
        """Return the newest released command of this tick of the master clock.

        Args:
            observation: What is linked to the channel; None is enough unless ``is_due``.

        Raises:
            ValueError: The channel is due and there is no observation.
        """
        if self.is_due:
            if observation is None:
                msg = "a due channel needs an observation"
                raise ValueError(msg)
            self._waiting.append((self._tick + self._delay, self._channel.act(observation)))
        while self._waiting and self._waiting[0][0] <= self._tick:
            self._newest = self._waiting.popleft()[1]
        self._tick += 1
        return self._newest


# --- The channels of an architecture, built for a batch and called together at every tick ---------


class Contexts:
    """What the channels of a batch are built with."""

    def __init__(self, cases: Sequence[TestCase], scene: SceneContext) -> None:
        """Gather what several of them are told.

        Args:
            cases: Test cases of one structure.
            scene: What does not change during the runs.
        """
        sensors = cases[0].architecture.sensors
        self._cases, self._scene = cases, scene
        self._poses, self._sheets = mounts(cases), data_sheets(cases)
        self._kinds = {name: sensor.kind for name, sensor in sensors.items()}
        self._models = {name: model_name(sensor) for name, sensor in sensors.items()}
        self._desired = ego_desired_speeds(cases)

    def of(self, name: str, *, shows_candidates: bool = True) -> ChannelContext:
        """Return what a channel is built with."""
        cases, scene = self._cases, self._scene
        spec = cases[0].architecture.channels[name]
        every = period_ticks(spec.rate, scene.step, f"channels.{name}.rate")

        def linked(known: Mapping[str, Any]) -> dict[str, Any]:
            return {link: known[link] for link in spec.links if link in known}

        return ChannelContext(
            channel_id=name,
            parameters=[case.architecture.channels[name].parameters for case in cases],
            links=spec.links,
            sensors=linked(self._kinds),
            mounts=linked(self._poses),
            vehicles=[case.architecture.vehicle for case in cases],
            road=scene.road,
            desired_speed=self._desired,
            step=scene.step,
            period=every * scene.step,
            shows_candidates=shows_candidates,
            data_sheets=linked(self._sheets),
            models=linked(self._models),
        )


class Watch(NamedTuple):
    """Who looks on while channels decide; the trace is the same with and without."""

    drawn: bool = False
    """Whether somebody looks at what channels weighed up."""
    witness: Witness | None = None
    """Who takes down what a channel is shown."""
    pace: Pace | None = None
    """Who measures how long channels take."""


class ChannelRack:
    """Every channel of the architecture, also those without authority."""

    def __init__(
        self,
        cases: Sequence[TestCase],
        scene: SceneContext,
        base_dir: Path,
        *,
        watch: Watch = Watch(),  # noqa: B008 - it holds nothing that changes
        only: Collection[str] | None = None,
    ) -> None:
        """Build the channels of a batch.

        Args:
            cases: Test cases of one structure.
            scene: What does not change during the runs.
            base_dir: Folder of the file that names plug-ins.
            watch: Who looks on.
            only: Which channels to build; None for all.
        """
        architecture = cases[0].architecture
        contexts = Contexts(cases, scene)
        self._runs = len(cases)
        self._links: dict[str, tuple[str, ...]] = {}
        self._clocked: dict[str, ClockedChannel] = {}
        self._inner: dict[str, ControlChannel] = {}
        self._is_plugin: dict[str, bool] = {}
        for name, spec in architecture.channels.items():
            if only is not None and name not in only:
                continue
            delay = ticks(spec.delay, scene.step, f"channels.{name}.delay")
            files = [getattr(case.architecture.channels[name], "files", ()) for case in cases]
            inner = make_channel(spec.kind, base_dir, spec.parameters, files)
            self._inner[name] = inner
            if watch.witness is not None and watch.witness.channel == name:
                inner = WitnessedChannel(inner, spec.kind, watch.witness)
            # A plug-in sees no difference, so it cannot make one.
            context = contexts.of(name, shows_candidates=watch.drawn or spec.kind not in BUILT_IN)
            if watch.pace is not None:
                inner = watch.pace.timed(name, inner)
            clocked = ClockedChannel(inner, round(context.period / context.step), delay)
            # What is not ours shares no memory with the world, nor with other channels.
            clocked.reset(deepcopy(context) if ":" in spec.kind else context)
            self._links[name] = spec.links
            self._clocked[name] = clocked
            self._is_plugin[name] = spec.kind not in BUILT_IN
        self._clusterings: dict[str, Clustering] = {}
        for name, sensor in architecture.sensors.items():
            if isinstance(sensor, PhysicalLidar):
                specs: list[Any] = [case.architecture.sensors[name] for case in cases]
                self._clusterings[name] = Clustering(specs, len(scene.object_ids))
        self._commands: dict[str, ControlCommand] = {}
        self._authority: Authority | None = None

    @property
    def channels(self) -> Mapping[str, ControlChannel]:
        """The channels themselves by id, without their cadence."""
        return self._inner

    @property
    def monitor_ids(self) -> tuple[str, ...]:
        """Monitors of all channels, in the order of the channels."""
        return tuple(name for channel in self._clocked.values() for name in channel.monitor_ids)

    @property
    def events(self) -> list[ChannelEvent | None]:
        """First failure of any channel in each run, with those of the others after it."""
        merged: list[ChannelEvent | None] = [None] * self._runs
        for channel in self._inner.values():
            own = getattr(channel, "events", merged)
            merged = [_earlier(a, b) for a, b in zip(merged, own, strict=True)]
        return merged

    def close(self) -> None:
        """Let go of what channels hold outside of this process."""
        for channel in self._inner.values():
            close = getattr(channel, "close", None)
            if close is not None:
                close()

    def detect(self, readings: Mapping[str, Measurement]) -> dict[str, Measurement]:
        """Find objects in what needs perception to show any, once for all channels.

        Args:
            readings: Newest measurement of every sensor, after faults.
        """
        found = dict(readings)
        for name, clustering in self._clusterings.items():
            if name in readings:
                found[name] = clustering.detect(readings[name])
        return found

    def act(
        self,
        scene: Scene,
        readings: Mapping[str, Measurement],
        distort: Callable[[str, View], View] | None = None,
    ) -> list[ControlCommand]:
        """Ask every channel for its command at this tick.

        Args:
            scene: Ground truth at the tick.
            readings: Newest measurement of every sensor, after faults.
            distort: Makes of the view what a channel is shown instead; asked at every tick, also
                where the channel is not due.
        """
        proposals = []
        view = View(readings, self._commands, self._authority)
        for name, channel in self._clocked.items():
            observation = None
            shown = view if distort is None else distort(name, view)
            if channel.is_due:
                observation = observe(
                    self._links[name],
                    scene.time,
                    shown.measurements,
                    shown.commands,
                    shown.authority,
                    scene.running,
                    protect=self._is_plugin[name],
                    health=shown.health,
                )
            proposals.append(channel.act(observation))
        return proposals

    def remember(self, proposals: Sequence[ControlCommand], authority: Authority) -> None:
        """Keep what linked channels will see at the next tick: commands after faults, authority."""
        self._commands = {proposal.channel: proposal for proposal in proposals}
        self._authority = Authority(authority.channel.copy(), authority.reason.copy())


def _earlier(one: ChannelEvent | None, other: ChannelEvent | None) -> ChannelEvent | None:
    if one is None or other is None:
        return one or other
    first, later = (one, other) if one.time <= other.time else (other, one)
    # What the later failure depends on, the rest of the run does.
    is_dependent = one.is_machine_dependent or other.is_machine_dependent
    others = sorted((*first.later, later, *later.later), key=lambda event: event.time)
    return replace(
        first,
        is_machine_dependent=is_dependent,
        later=tuple(replace(event, later=()) for event in others),
    )
