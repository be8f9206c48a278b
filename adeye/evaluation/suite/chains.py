"""How long it takes from a thing in sight to acting brakes, and the way that this needs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.evaluation.suite.results import Chain
from adeye.kernel.detection_range import needed_ranges
from adeye.kernel.motion import GRAVITY
from adeye.spec.channels import NominalParameters

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from adeye.evaluation.suite.conditions import Condition
    from adeye.signals import Floats
    from adeye.spec.architecture import Architecture
    from adeye.spec.channels import Channel

MARGIN: Final = 2.0
"""Gap that is left at standstill [m]: the least following distance of UN R157, 5.2.3.3 (below
2 m/s)."""

SAFETY_HITS: Final = 2
"""Samples that confirm a track of the built-in safety channel."""

_BUILT_IN: Final = NominalParameters()


def chains_of(architecture: Architecture) -> Iterator[Chain]:
    """List every way from a sensor to the brakes, one for each link of a sensor to a channel.

    The waits are the longest: an object comes into sight just after a sample, and its track is
    confirmed just after a tick of the channel. Hits of several sensors on one track are not added
    up, and rounding to the master clock is left out.

    Args:
        architecture: With sensors, channels, switch and vehicle.
    """
    for name, channel in architecture.channels.items():
        for link in channel.links:
            if link in architecture.sensors:
                yield _chain(architecture, link, name, channel)


def _chain(architecture: Architecture, link: str, name: str, channel: Channel) -> Chain:
    sensor, vehicle = architecture.sensors[link], architecture.vehicle
    is_safety = channel.kind == "safety"
    found = _parameters(channel)
    hits = SAFETY_HITS if is_safety else found.get("confirm_hits", _BUILT_IN.confirm_hits)
    braking = found.get("emergency_deceleration", _BUILT_IN.emergency_deceleration)
    period = 1.0 / sensor.rate
    waits = channel.delay + 1.0 / channel.rate
    if name != architecture.switch.default:
        waits += architecture.switch.debounce + architecture.switch.handover
    return Chain(
        sensor=link,
        channel=name,
        sense_s=period + sensor.latency + sensor.jitter,
        confirm_s=(hits - 1) * period + (found.get("confirm", 0.0) if is_safety else 0.0),
        decide_s=waits,
        act_s=vehicle.acceleration_lag,
        deceleration_mps2=min(braking, vehicle.max_deceleration),
        is_assumed=not is_safety and not {"confirm_hits", "emergency_deceleration"} <= set(found),
    )


def _parameters(channel: Channel) -> Mapping[str, Any]:
    """Read what a channel declares; the numbers of a plug-in are taken where they are numbers."""
    parameters = channel.parameters
    found = parameters if isinstance(parameters, dict) else parameters.model_dump()
    return {
        key: value
        for key, value in found.items()
        if isinstance(value, int | float) and not isinstance(value, bool)
    }


def braking_of(chain: Chain, condition: Condition) -> float:
    """Return the deceleration that channel, vehicle and grip allow [m/s²]."""
    return min(chain.deceleration_mps2, condition.friction * GRAVITY)


def needed_ranges_of(chain: Chain, condition: Condition, closing_speeds: Floats) -> Floats:
    """Compute the gap in which the ego comes down to the speed of what is ahead [m].

    ``v·t + v²/(2a) + margin``, with t the waits of the chain.

    Args:
        chain: From the sensor to the brakes.
        condition: Whose grip limits the deceleration.
        closing_speeds: Speed differences (N,) [m/s].
    """
    out = np.zeros(closing_speeds.shape)
    braking = braking_of(chain, condition)
    needed_ranges(closing_speeds, chain.total_s, braking, MARGIN, out)
    return out
