"""A supervised safety channel in a tiny closed loop, and under a made-up observation."""

from pathlib import Path
from typing import Any

import numpy as np

from adeye.signals import FAULT, Bools, ControlCommand
from adeye.signals import SILENT as SILENT_STATUS
from adeye.simulate.channels.factory import make_channel
from adeye.simulate.channels.nominal import NominalChannel
from adeye.spec.architecture import Switch
from adeye.spec.channels import NominalParameters, SafetyParameters
from adeye.testing import Drive, ScriptedChannel, World, channel_context, drive
from adeye.testing.driving import Hook
from adeye.testing.scenes import straight_road

NOMINAL, SAFETY, OTHER = 0, 1, 2
LINKS = {
    "nominal": ("front", "pose"),
    "safety": ("truth", "channels.nominal", "switch", "channels.other"),
    "other": ("pose",),
}
SENSORS = {"front": "radar", "pose": "localisation", "truth": "ground_truth"}
LATCHED = Switch(
    policy="fixed_priority", priority=("safety", "nominal"), default="nominal", latch=True
)
SILENT = {"kind": "channel_silent", "watches": ["nominal"]}
OTHER_SILENT = {"kind": "channel_silent", "watches": ["other"]}
"""Of a channel that never acts, so that the switch does nothing of its own."""


def parameters(
    monitors: dict[str, Any], *, stop: str = "planned", **supervisor: Any
) -> SafetyParameters:
    content = {"stop": stop, "supervisor": {"monitors": monitors, **supervisor}}
    return SafetyParameters.model_validate(content)


def run(  # noqa: PLR0913 - each is one thing that a test may want to set
    world: World,
    item: SafetyParameters,
    horizon: float = 6.0,
    *,
    on_commands: Hook | None = None,
    switch: Switch = LATCHED,
    nominal: Any = None,
    links: tuple[str, ...] = LINKS["safety"],
) -> Drive:
    """Drive with a nominal channel, the safety channel of these parameters, and one that rests."""
    listened = LINKS | {"safety": links}
    channels = {
        "nominal": nominal or NominalChannel(),
        "safety": make_channel("safety", Path(), item),
        "other": ScriptedChannel([0.0]),
    }
    numbers = {"nominal": NominalParameters(), "safety": item, "other": None}
    for name, channel in channels.items():
        channel.reset(
            channel_context(
                numbers[name],
                links=listened[name],
                sensors={link: SENSORS[link] for link in listened[name] if link in SENSORS},
                channel_id=name,
                desired_speed=world.speed,
                road=world.road or straight_road(),
            )
        )
    return drive(channels, listened, world, horizon=horizon, switch=switch, on_commands=on_commands)


def column(done: Drive, item: SafetyParameters, name: str, which: int = 1) -> Bools:
    """Tell at which ticks a monitor was confirmed, or fired as it stands at 0."""
    number = make_channel("safety", Path(), item).monitor_ids.index(name)
    rows = [shown[SAFETY] for shown in done.monitors]
    return np.array([row[number, which] for row in rows if row is not None])


def first(done: Drive, flags: Bools) -> float:
    """Return the time of the first row that is set [s]."""
    assert flags.any()
    return float(done.time[int(np.argmax(flags))])


def changed(first_at: float, change: Any, last: float = np.inf, which: int = NOMINAL) -> Hook:
    """Change the commands of a channel for a while."""

    def hook(time: float, proposals: list[ControlCommand]) -> list[ControlCommand]:
        if not first_at - 1e-9 <= time < last - 1e-9:
            return proposals
        other = proposals[which].copy()
        change(other)
        return [*proposals[:which], other, *proposals[which + 1 :]]

    return hook


def silence(first_at: float, last: float = np.inf) -> Hook:
    """Make the nominal channel silent for a while; the switch does not see it by its state."""

    def quiet(command: ControlCommand) -> None:
        command.status[:] = SILENT_STATUS
        command.stamp[:] = first_at - 0.05

    return changed(first_at, quiet, last)


def faulty(first_at: float, last: float = np.inf) -> Hook:
    """Let the channel that never acts be in fault for a while."""

    def fail(command: ControlCommand) -> None:
        command.status[:] = FAULT

    return changed(first_at, fail, last, OTHER)
