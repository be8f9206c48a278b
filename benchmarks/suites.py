"""What does a suite of sensors cost a whole run, over that of ground truth alone?

The runs are those of ``closed_loop.py`` with five objects: a lead brakes hard amid reactive
vehicles, on wet roads. The base is a nominal channel that drives on ground truth alone, without a
safety channel. Suites are added to it, first with no channel linked to them: that is what sensing
costs, with delivery and recording; finding objects in the returns of lidars is taken off and
given on its own. Then the nominal channel is linked to the suite and not to the truth. Last come
channels, and the filter for the ego, which are added beside the others and have no authority.

Nothing is judged, which only makes the ratios larger. A suite that sees something in less than half
of the ticks is refused. CPU time of one process and one thread per run and tick, as long as a run
lasts; rounds interleaved, the warm-up thrown away; a bar is for the ratio to the base.

    python benchmarks/suites.py            the whole measurement
    python benchmarks/suites.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import statistics
import sys
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from closed_loop import ODD, Size, test_cases
from support.command import drive, ratios, spread

from adeye.simulate import engine
from adeye.simulate.channels.perception.clustering import Clustering
from adeye.simulate.recorder import Memory
from adeye.spec.architecture import Architecture
from adeye.spec.load import load_odd

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from adeye.signals import Measurement
    from adeye.sweep.case import TestCase
    from adeye.trace import Trace

SIZE: Final = Size(vehicles=6, runs=1024, seconds=20.0, roads=0)
BASE: Final = "ground truth"

Sensors = dict[str, dict[str, Any]]


def _around(fields: Mapping[str, Any]) -> Sensors:
    """Give four sensors of a kind, one to each side."""
    places = {"front": (2.45, 0.0, 0), "left": (0.0, 0.95, 90)}
    places |= {"rear": (-2.45, 0.0, 180), "right": (0.0, -0.95, -90)}
    return {
        f"{name}_{fields['kind']}": {
            **fields,
            "mount": {"x": f"{x} m", "y": f"{y} m", "z": "0.6 m", "yaw": f"{yaw} deg"},
        }
        for name, (x, y, yaw) in places.items()
    }


TRUTH: Final[Sensors] = {"truth": {"kind": "ground_truth", "rate": "20 Hz"}}
POSE: Final[Sensors] = {
    "localisation": {
        "kind": "localisation",
        "rate": "20 Hz",
        "lateral_noise": "0.02 m",
        "heading_noise": "0.05 deg",
        "speed_noise": "0.05 m/s",
    }
}
EGO: Final[Sensors] = {
    "gnss": {
        "kind": "gnss",
        "rate": "10 Hz",
        "position_noise": "0.05 m",
        "bias": "0.05 m",
        "speed_noise": "0.05 m/s",
    },
    "imu": {
        "kind": "imu",
        "rate": "20 Hz",
        "acceleration_noise": "0.05 m/s^2",
        "acceleration_bias": "0.05 m/s^2",
        "yaw_rate_noise": "0.1 deg/s",
        "yaw_rate_bias": "0.05 deg/s",
    },
}
CAMERA: Final[Sensors] = {
    "camera": {
        "kind": "camera",
        "mount": {"x": "1.5 m", "z": "1.3 m"},
        "field_of_view": "50 deg",
        "range": "120 m",
        "rate": "20 Hz",
        "bearing_noise": "0.1 deg",
        "distance_noise": 0.02,
    }
}
RADAR: Final = {
    "kind": "radar",
    "field_of_view": "40 deg",
    "range": "200 m",
    "rate": "20 Hz",
}
RADARS: Final[Sensors] = {
    name: {
        **RADAR,
        "mount": {"x": x, "z": "0.5 m", "yaw": yaw},
        "range_noise": "0.3 m",
        "bearing_noise": "0.2 deg",
        "range_rate_noise": "0.1 m/s",
    }
    for name, x, yaw in (("front_radar", "2.3 m", "0 deg"), ("rear_radar", "-2.3 m", "180 deg"))
}
CELLS: Final[Sensors] = {
    name: {**RADAR, "fidelity": "physical", "mount": fields["mount"]}
    for name, fields in RADARS.items()
}
LIDARS: Final = _around(
    {
        "kind": "lidar",
        "fidelity": "physical",
        "field_of_view": "120 deg",
        "range": "150 m",
        "rate": "10 Hz",
        "beams": 900,
        "range_noise": "0.03 m",
        "bearing_noise": "0.05 deg",
    }
)
PICTURE: Final[Sensors] = {
    "picture": {
        "kind": "camera",
        "fidelity": "physical",
        "mount": {"x": "1.5 m", "z": "1.3 m"},
        "field_of_view": "50 deg",
        "rate": "20 Hz",
        "columns": 160,
        "rows": 60,
    }
}

SUITES: Final[dict[str, tuple[Sensors, float]]] = {
    "camera, 2 radars": ({**CAMERA, **RADARS}, 3.0),
    "4 lidars of 900 beams": (LIDARS, 15.0),
    "camera of 160 x 60": (PICTURE, 10.0),
    "camera of 160 x 60, 2 radars with cells": ({**PICTURE, **CELLS}, 10.0),
}
"""What is added, and the most that a run with it may cost, as a ratio to the base."""


@dataclass(frozen=True)
class Case:
    """What is measured.

    Attributes:
        architecture: With what is added.
        without: Name of the case that it is compared with.
        seen: Sensors of which one sees something in at least half of the ticks.
        bar: Most of the ratio to that case, None for no bar.
        is_sensing: Whether finding objects in returns is taken off.
    """

    architecture: Architecture
    without: str
    seen: tuple[str, ...] = ()
    bar: float | None = None
    is_sensing: bool = False


def architecture(
    sensors: Sensors, links: Sequence[str], third: Mapping[str, Any] | None = None
) -> Architecture:
    """Make an architecture whose nominal channel is linked to some sensors.

    Args:
        sensors: By id, as in YAML.
        links: Of the nominal channel.
        third: A channel without authority beside it.
    """
    channels: dict[str, Any] = {"nominal": {"kind": "nominal", "links": list(links)}}
    if third is not None:
        channels["third"] = dict(third)
    return Architecture.model_validate(
        {
            "architecture": "measured",
            "title": "Measured",
            "vehicle": load_odd(ODD).architectures["camera_radar"].spec.vehicle,
            "sensors": sensors,
            "channels": channels,
            "switch": {
                "policy": "fixed_priority",
                "priority": ["nominal"],
                "default": "nominal",
                "staleness": "0.3 s",
            },
        }
    )


def cases() -> Iterator[tuple[str, Case]]:
    """List what is measured, the base first."""
    yield BASE, Case(architecture(TRUTH, ["truth"]), BASE)
    for name, (sensors, bar) in SUITES.items():
        added = architecture({**TRUTH, **sensors}, ["truth"])
        yield name, Case(added, BASE, tuple(sensors), bar, is_sensing=True)
    for name, (sensors, _) in SUITES.items():
        linked = architecture({**POSE, **sensors}, ["localisation", *sensors])
        yield f"{name}, linked", Case(linked, BASE, tuple(sensors))
    sensors = {**TRUTH, **POSE, **EGO, **CAMERA, **RADARS}
    beside, seen = "channels beside", ("camera", "front_radar", "rear_radar")
    yield beside, Case(architecture(sensors, ["truth"]), BASE, seen)
    for kind in ("nominal", "trajectory"):
        third = {"kind": kind, "links": ["localisation", *seen]}
        yield f"{kind} channel", Case(architecture(sensors, ["truth"], third), beside, seen)
    third = {"kind": "nominal", "links": ["gnss", "imu", *seen]}
    filtered = architecture(sensors, ["truth"], third)
    yield "filter of gnss and imu", Case(filtered, "nominal channel", seen)


class Clock:
    """Adds up the CPU time of finding objects in the returns of lidars."""

    def __init__(self) -> None:
        """Stand at zero."""
        self.seconds = 0.0

    def watch(self) -> None:
        """Stop the time of every clustering from now on."""
        detect = Clustering.detect

        def timed(clustering: Clustering, reading: Measurement) -> Measurement:
            began = time.process_time()
            found = detect(clustering, reading)
            self.seconds += time.process_time() - began
            return found

        Clustering.detect = timed  # type: ignore[method-assign]


@dataclass(frozen=True)
class Cost:
    """CPU time per run and tick [µs]: of all, and of finding objects in returns within it."""

    total: float
    clusters: float


def cost(batch: list[TestCase], seen: Sequence[str], memory: Memory, clock: Clock) -> Cost:
    """Execute a batch."""
    clock.seconds = 0.0
    began = time.process_time()
    trace = engine.run(batch, memory=memory)
    taken = time.process_time() - began
    require_sight(trace, seen)
    ticks = float(trace.length.sum())
    return Cost(1e6 * taken / ticks, 1e6 * clock.seconds / ticks)


def require_sight(trace: Trace, seen: Sequence[str]) -> None:
    """Refuse a trace in which some sensors see next to nothing.

    Raises:
        RuntimeError: In less than half of the ticks one of them sees anything.
    """
    if not seen:
        return
    rows = np.arange(trace["authority"].shape[1]) < trace.length[:, np.newaxis]
    columns = [trace.layout.sensors.index(name) for name in seen]
    share = trace["detected"][:, :, columns].any(axis=(2, 3))[rows].mean()
    if share < 0.5:
        msg = f"{', '.join(seen)} see something in {share:.0%} of the ticks"
        raise RuntimeError(msg)


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure every case once a round."""
    plain = test_cases(replace(SIZE, runs=8, seconds=5.0) if smoke else SIZE)
    listed = dict(cases())
    batches = {
        name: [replace(each, architecture=case.architecture) for each in plain]
        for name, case in listed.items()
    }
    took: dict[str, list[Cost]] = {name: [] for name in listed}
    memory, clock = Memory(), Clock()
    clock.watch()
    for number in range(rounds + 1):
        for name, case in listed.items():
            found = cost(batches[name], case.seen, memory, clock)
            if number:
                took[name].append(found)
    return [_summary(name, case, took) for name, case in listed.items()]


def _summary(name: str, case: Case, took: Mapping[str, list[Cost]]) -> dict[str, Any]:
    mine = [one.total - (one.clusters if case.is_sensing else 0.0) for one in took[name]]
    other = [one.total for one in took[case.without]]
    pairs = list(zip(mine, other, strict=True))
    return {
        "added": name,
        "to": case.without,
        "bar": case.bar,
        "us": statistics.median(mine),
        "added_us": statistics.median(one - before for one, before in pairs),
        "clusters_us": statistics.median(one.clusters for one in took[name]),
        **ratios(pairs),
    }


HEADERS = ("what is added", "to", "µs per tick", "added", "clusters", "bar", "ratio (spread)")


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    return [
        item["added"],
        item["to"],
        *(f"{item[key]:.2f}" for key in ("us", "added_us", "clusters_us")),
        "-" if item["bar"] is None else f"{item['bar']:g}",
        spread(item),
    ]


if __name__ == "__main__":
    sys.exit(drive("suites", __doc__, measure, HEADERS, row))
