"""A supervised safety channel in a tiny closed loop, and under a made-up observation."""

from typing import Any

import numpy as np

from adeye.signals import FAULT, Bools, ControlCommand
from adeye.simulate.channels.nominal import NominalChannel
from adeye.simulate.channels.safety import SupervisedSafetyChannel
from adeye.spec.channels import NominalParameters, SafetyParameters
from adeye.spec.switch import Switch
from adeye.testing import Drive, ScriptedChannel, World, channel_context, drive
from adeye.testing.driving import Hook
from adeye.testing.scenes import straight_road

NOMINAL, SAFETY, OTHER = 0, 1, 2
LINKS = {
    "nominal": ("front", "pose"),
    "safety": ("truth", "channels.nominal", "switch", "channels.other"),
    "other": ("pose",),
}
SILENT = {"kind": "channel_silent", "watches": ["nominal"]}
OTHER_SILENT = {"kind": "channel_silent", "watches": ["other"]}
"""Of a channel that never acts, so that the switch does nothing of its own."""


def parameters(
    monitors: dict[str, Any], *, stop: str = "planned", **supervisor: Any
) -> SafetyParameters:
    content = {"stop": stop, "supervisor": {"monitors": monitors, **supervisor}}
    return SafetyParameters.model_validate(content)


def run(
    world: World,
    item: SafetyParameters,
    horizon: float = 6.0,
    *,
    on_commands: Hook | None = None,
    latch: bool = True,
) -> Drive:
    nominal, safety, other = NominalChannel(), SupervisedSafetyChannel(item), ScriptedChannel([0.0])
    road = world.road or straight_road()
    sensors = {
        "nominal": {"front": "radar", "pose": "localisation"},
        "safety": {"truth": "ground_truth"},
        "other": {"pose": "localisation"},
    }
    channels: tuple[tuple[str, Any, Any], ...] = (
        ("nominal", nominal, NominalParameters()),
        ("safety", safety, item),
        ("other", other, None),
    )
    for name, channel, numbers in channels:
        channel.reset(
            channel_context(
                numbers,
                links=LINKS[name],
                sensors=sensors[name],
                channel_id=name,
                desired_speed=world.speed,
                road=road,
            )
        )
    switch = Switch(
        policy="fixed_priority", priority=("safety", "nominal"), default="nominal", latch=latch
    )
    return drive(
        {"nominal": nominal, "safety": safety, "other": other},
        LINKS,
        world,
        horizon=horizon,
        switch=switch,
        on_commands=on_commands,
    )


def column(done: Drive, item: SafetyParameters, name: str, which: int = 1) -> Bools:
    number = SupervisedSafetyChannel(item).monitor_ids.index(name)
    rows = [shown[SAFETY] for shown in done.monitors]
    return np.array([row[number, which] for row in rows if row is not None])


def first(done: Drive, flags: Bools) -> float:
    """Return the time of the first row that is set [s]."""
    assert flags.any()
    return float(done.time[int(np.argmax(flags))])


def changed(first_at: float, change: Any, last: float = np.inf) -> Hook:
    """Change the nominal channel's commands for a while."""

    def hook(time: float, proposals: list[ControlCommand]) -> list[ControlCommand]:
        if not first_at - 1e-9 <= time < last - 1e-9:
            return proposals
        other = proposals[NOMINAL].copy()
        change(other)
        return [other, *proposals[SAFETY:]]

    return hook


def faulty(first_at: float, last: float = np.inf) -> Hook:
    """Let the channel that never acts be in fault for a while."""

    def hook(time: float, proposals: list[ControlCommand]) -> list[ControlCommand]:
        if not first_at - 1e-9 <= time < last - 1e-9:
            return proposals
        other = proposals[OTHER].copy()
        other.status[:] = FAULT
        return [*proposals[:OTHER], other]

    return hook
