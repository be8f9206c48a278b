"""How fast a suite lets the ego go: needed range against the range that sensors have."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.analysis.suite.geometry import distance, looks_at
from adeye.analysis.suite.records import Chain, ForwardRange, Slack, SpeedRange
from adeye.kernel.detection_range import needed_ranges
from adeye.kernel.motion import GRAVITY
from adeye.spec.channels import NominalParameters

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from adeye.analysis.suite.conditions import Case, Condition
    from adeye.analysis.suite.geometry import Reach, View
    from adeye.signals import Bools, Floats
    from adeye.spec.architecture import Architecture
    from adeye.spec.channels import Channel

# --- How long it takes from a thing in sight to acting brakes, and the way that this needs --------

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


# --- The least forward detection range that UN R157 asks for --------------------------------------

TABLE: Final = (
    (60.0 / 3.6, 46.0),
    (70.0 / 3.6, 50.0),
    (80.0 / 3.6, 60.0),
    (90.0 / 3.6, 75.0),
    (100.0 / 3.6, 90.0),
    (110.0 / 3.6, 110.0),
    (120.0 / 3.6, 130.0),
    (130.0 / 3.6, 150.0),
)
"""Highest speed of the system [m/s] and least forward detection range [m], from the foremost point
of the vehicle: UN R157, 01 series of amendments, paragraph 7.1.1. Between the rows it is
interpolated linearly here."""


def least_forward_range(speed: float) -> float | None:
    """Return the least forward detection range for a system of some highest speed [m].

    Args:
        speed: [m/s].

    Returns:
        That of 60 km/h for all below; None above 130 km/h, where the regulation ends.

    >>> least_forward_range(130.0 / 3.6)
    150.0
    """
    if speed <= TABLE[0][0]:
        return TABLE[0][1]
    for (low, near), (high, far) in pairwise(TABLE):
        if speed <= high:
            return far if speed == high else near + (far - near) * (speed - low) / (high - low)
    return None


def speed_by_range(forward_range: float) -> float | None:
    """Return the highest speed for which a forward detection range suffices [m/s].

    Args:
        forward_range: [m].

    Returns:
        None below the range of 60 km/h; 130 km/h at most.
    """
    if forward_range < TABLE[0][1]:
        return None
    for (low, near), (high, far) in pairwise(TABLE):
        if forward_range < far:
            return low + (high - low) * (forward_range - near) / (far - near)
    return TABLE[-1][0]


# --- How fast a suite lets the ego go: needed range against the range that sensors have -----------

SPEEDS: Final = np.arange(100, 2501) / 36.0
"""Speeds that are tried [m/s]: 10 to 250 km/h in steps of 0.1 km/h."""

SHOWN: Final = (30.0, 50.0, 60.0, 80.0, 100.0, 120.0, 130.0)
"""Speeds that slack is listed for [km/h]."""

_AHEAD: Final = 0.5
"""Distance between two looks straight ahead [m]."""


@dataclass(frozen=True)
class Path:
    """One chain with the eyes of its sensor.

    Attributes:
        chain: From the sensor to the brakes.
        view: Where the sensor looks.
        reaches: From where to where, by condition and target.
    """

    chain: Chain
    view: View
    reaches: Mapping[tuple[str, str], Reach]


def slacks_at(
    path: Path, condition: Condition, case: Case, speeds: Floats, front: float
) -> tuple[Floats, Floats]:
    """Compare the range that a sensor has with what a speed needs.

    A pedestrian who is to be hit stays at one bearing: at the needed range he is as far aside as
    he walks while the ego, not braking, gets to his path. He may come from both sides.

    Args:
        path: The chain.
        condition: Weather, light and grip.
        case: What asks for range.
        speeds: Of the ego (N,), positive [m/s].
        front: Of the ego from its box centre [m].

    Returns:
        Needed range from the front (N,) and range to spare (N,) [m]; minus infinity where the
        sensor does not look at the place.
    """
    need = needed_ranges_of(path.chain, condition, speeds - case.speed_mps)
    aside = case.crossing_mps * need / speeds
    spare = np.full(speeds.shape, np.inf)
    reach = path.reaches[condition.id, case.target]
    for side in (1.0, -1.0) if case.crossing_mps else (1.0,):
        x, y = front + need, side * aside
        away = distance(path.view, x, y)
        is_looked_at = looks_at(path.view, x, y) & (away >= reach.near) & (reach.far > reach.near)
        spare = np.minimum(spare, np.where(is_looked_at, reach.far - away, -np.inf))
    return need, spare


def supported(path: Path, condition: Condition, case: Case, front: float) -> Bools:
    """Tell which of ``SPEEDS`` the range of one chain suffices for."""
    _, spare = slacks_at(path, condition, case, SPEEDS, front)
    out: Bools = spare >= 0.0
    return out


def last_run(ok: Bools) -> tuple[int, int] | None:
    """Find the last stretch of speeds without a gap: first and last place, or None.

    The last, because what is found so never grows when a sensor is lost: with the first, the loss
    of one that serves a few low speeds only would seem to be a gain.
    """
    places = np.flatnonzero(ok)
    if not len(places):
        return None
    last = int(places[-1])
    gaps = np.flatnonzero(~ok[:last])
    return (int(gaps[-1]) + 1 if len(gaps) else 0), last


def speed_range(
    paths: Sequence[Path], oks: Sequence[Bools], condition: Condition, case: Case
) -> SpeedRange:
    """Find the highest speed that a chain supports, and how far down there is no gap.

    Args:
        paths: Chains.
        oks: Speeds that each supports.
        condition: Weather, light and grip.
        case: What asks for range.
    """
    found = last_run(np.any(oks, axis=0)) if oks else None
    if found is None:
        return SpeedRange(condition.id, case.id, None, None, is_limit=False, sensor="",
                          deceleration_mps2=None)  # fmt: skip
    low, high = found
    best = next(path for path, ok in zip(paths, oks, strict=True) if ok[high])
    return SpeedRange(
        condition=condition.id,
        case=case.id,
        lowest_mps=float(SPEEDS[low]),
        highest_mps=float(SPEEDS[high]),
        is_limit=high == len(SPEEDS) - 1,
        sensor=best.chain.sensor,
        deceleration_mps2=braking_of(best.chain, condition),
    )


def slack_at(
    paths: Sequence[Path], condition: Condition, case: Case, speed: float, front: float
) -> Slack:
    """Take the chain with the most range to spare at a speed.

    Args:
        paths: Chains.
        condition: Weather, light and grip.
        case: What asks for range.
        speed: Of the ego [m/s].
        front: Of the ego from its box centre [m].
    """
    best = Slack(condition.id, case.id, speed, None, None, "")
    most = -np.inf
    for path in paths:
        need, spare = slacks_at(path, condition, case, np.array([speed]), front)
        if spare[0] > most:
            most = spare[0]
            found = float(need[0]), float(spare[0])
            best = Slack(condition.id, case.id, speed, *found, path.chain.sensor)
    return best


def forward_range(
    paths: Sequence[Path], condition: Condition, front: float, odd_speed: float | None
) -> ForwardRange:
    """Measure the farthest car straight ahead and look it up in the table of UN R157.

    Args:
        paths: Chains.
        condition: Weather and light.
        front: Of the ego from its box centre [m].
        odd_speed: Highest of the ODD, if there is one [m/s].
    """
    best, sensor = 0.0, ""
    for path in paths:
        found = _straight_ahead(path.view, path.reaches[condition.id, "car"], front)
        if found > best:
            best, sensor = found, path.chain.sensor
    return ForwardRange(
        condition=condition.id,
        range_m=best,
        sensor=sensor,
        speed_mps=speed_by_range(best),
        needed_m=None if odd_speed is None else least_forward_range(odd_speed),
    )


def _straight_ahead(view: View, reach: Reach, front: float) -> float:
    """Farthest place on the ego's axis ahead that is detected, from the front [m]."""
    if reach.far <= max(abs(view.y), reach.near):
        return 0.0
    # Solved on the circle of the range; a field of view may end before it.
    end = view.x + float(np.sqrt(reach.far * reach.far - view.y * view.y)) - front
    if end <= 0.0:
        return 0.0
    places = np.append(np.arange(_AHEAD, end, _AHEAD), end)
    seen = looks_at(view, front + places, np.zeros(places.shape))
    seen &= distance(view, front + places, np.zeros(places.shape)) >= reach.near
    return float(places[seen][-1]) if seen.any() else 0.0
