"""The example files that ``adeye new`` writes; each works as it stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

CHANNEL: Final = '''\
"""$class_name, a control channel: keeps its lane and its distance. Change it and run again."""

import math

from adeye import ports
from adeye.channels.scalar import ScalarCommand, ScalarContext, ScalarObservation


class $class_name:
    """One object per run. It sees what `links` names, nothing else; if it raises, it is silent."""

    class Parameters(ports.Parameters):
        """May be set under `parameters:`, and swept."""

        time_gap: float = 1.8  # [s]

    def __init__(self, parameters: Parameters, context: ScalarContext) -> None:
        self.time_gap = parameters.time_gap
        self.desired_speed = context.desired_speed  # [m/s]
        self.wheelbase = context.vehicle.wheelbase  # [m]

    def act(self, observation: ScalarObservation) -> ScalarCommand:
        """Return acceleration [m/s²] and steering angle [rad]."""
        speed, steering, ahead = self.desired_speed, 0.0, math.inf
        for measurement in observation.measurements.values():
            if measurement.estimate is not None and measurement.stamp >= 0.0:  # localisation
                _, _, heading, speed, *_ = measurement.estimate
                road_heading, curvature, _, offset = measurement.estimate[-4:]
                turn = math.remainder(heading - road_heading, math.tau)
                steering = self.wheelbase * curvature - 0.02 * offset - 0.3 * turn
            for x, y, *_ in measurement.detections:  # vehicle frame: x forward, y left [m]
                if x > 0.0 and abs(y) < 1.5:
                    ahead = min(ahead, x)
        cruise = 0.5 * (self.desired_speed - speed)
        follow = 0.5 * (ahead - 8.0 - self.time_gap * speed)
        return ScalarCommand(max(-8.0, min(1.5, cruise, follow)), steering)
'''

SENSOR: Final = '''\
"""$class_name, a sensor: the objects within its range, without error. Change it and run again."""

from adeye import ports
from adeye.kernel.elementary import sin_cos
from adeye.sensors.delivery import Delivery, no_measurement
from adeye.signals import Measurement, Scene


class $class_name:
    """Samples a batch of runs at its rate; a sample is delivered after its latency."""

    class Parameters(ports.Parameters):
        """May be set under `parameters:`, and swept."""

        range: float = 80.0  # [m]

    def __init__(self, context: ports.SensorContext) -> None:
        self.scene = context.scene
        self.objects = len(context.scene.object_ids)
        self.ranges = [self.Parameters(**spec.parameters).range for spec in context.specs]
        first = no_measurement(self.scene.runs, self.objects, with_estimate=False)
        self.delivery = Delivery.of(context, first)

    def sense(self, scene: Scene) -> Measurement:
        """Return the newest delivered sample; noise comes from adeye.kernel.random only."""
        if self.delivery.is_due(scene.tick):
            sample = no_measurement(self.scene.runs, self.objects, with_estimate=False)
            sample.stamp[:] = scene.time
            for run in range(self.scene.runs):
                self.sample(run, scene, sample)
            self.delivery.push(scene.tick, sample)
        return self.delivery.newest(scene.tick)

    def sample(self, run: int, scene: Scene, sample: Measurement) -> None:
        """List what one run's ego sees, the nearest first, in the vehicle frame."""
        x, y, heading = scene.ego[run, :3]
        sine, cosine = sin_cos(heading)
        away = [(ox - x) ** 2 + (oy - y) ** 2 for ox, oy in scene.objects[run, :, :2]]
        seen = [thing for thing in range(self.objects) if away[thing] <= self.ranges[run] ** 2]
        for row, thing in enumerate(sorted(seen, key=lambda index: away[index])):
            dx, dy = scene.objects[run, thing, 0] - x, scene.objects[run, thing, 1] - y
            length, width, _ = self.scene.object_sizes[run, thing]
            kind = self.scene.object_classes[thing]
            place = (cosine * dx + sine * dy, cosine * dy - sine * dx)
            sample.detections[run, row] = (*place, 0.0, 0.0, length, width, kind)
            sample.mask[run, row], sample.source[run, row] = True, thing
'''

METRIC: Final = '''\
"""$class_name, a metric: the highest speed of the ego. Change it and run again."""

import numpy as np

from adeye.ports import MetricColumn
from adeye.signals import EGO_SPEED
from adeye.trace import Trace


class $class_name:
    """Highest speed of the ego in the run."""

    uid = "local:$name@1"  # raise the version when the definition changes
    column = "${name}_mps"  # what requirements and tables call it
    unit = "m/s"
    worse = "higher"
    source = "example"

    def compute(self, trace: Trace) -> MetricColumn:
        """Return one value per run, with the time of the worst case."""
        rows = np.arange(trace.time.size)
        is_row = rows < trace.length[:, np.newaxis]  # runs end at different rows
        speed = np.where(is_row, trace["ego"][:, :, EGO_SPEED], -np.inf)
        worst = speed.argmax(axis=1)
        runs = range(trace.runs)
        return MetricColumn(
            speed[runs, worst], ("value",) * trace.runs, trace.time[worst], [-1] * trace.runs
        )
'''


@dataclass(frozen=True, slots=True)
class Example:
    """A kind of part with its example.

    Attributes:
        source: Text of the file, with ``$name`` and ``$class_name``.
        usage: YAML that uses it, with ``$name``, ``$class_name`` and ``$file``.
        where: Which file the YAML belongs to.
    """

    source: str
    usage: str
    where: str


EXAMPLES: Final = {
    "channel": Example(
        CHANNEL,
        "channels:\n"
        "  $name: {kind: $file:$class_name, links: [localisation, front_camera], rate: 20 Hz}",
        "an architecture; name it in the switch as well",
    ),
    "sensor": Example(
        SENSOR,
        "sensors:\n  $name: {kind: $file:$class_name, rate: 20 Hz, parameters: {range: 80}}",
        "an architecture; link a channel to it",
    ),
    "metric": Example(
        METRIC,
        "plugins: [$file:$class_name]",
        "an ODD; a requirement bounds it as {metric: ${name}_mps, at_most: 40}",
    ),
}
"""Examples by kind of part."""
