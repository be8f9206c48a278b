"""The parts of the bench: a car that drives well, a sensor, metrics; each with flaws on demand.

This file is copied beside the files of the bench and named in them, as a user's plug-ins are. Every
flaw is small and deliberate; ``none`` has none. The metrics are written anew from the definitions
and share no code with those of adeye: the good ones are a second opinion on the built-in ones.
"""

from __future__ import annotations

import math
import os
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from adeye import ports
from adeye.delivery import Delivery, no_measurement
from adeye.kernel.elementary import sin_cos
from adeye.ports import MetricColumn, ScalarCommand, ScalarContext, ScalarObservation

if TYPE_CHECKING:
    from adeye.signals import Floats, Measurement, Scene
    from adeye.trace import Trace

HARDEST = -8.0
"""Hardest braking of the car [m/s²]."""
LANE = 1.5
"""Half the width of what the car takes for its path [m]."""
OSCILLATION = 5
"""Ticks for which an oscillating car steers to one side."""
TWITCH = 1e-9
"""What a car that steers by the clock adds for a microsecond [rad]."""
NEAR = 12.0
"""Distance below which a metric that swallows NaN has none [m]."""
FAST = 22.0
"""Speed at the beginning above which a metric fails; one of two runs is faster [m/s]."""
DEGREES = 57.29577951308232
"""Degrees in a radian."""
STEERING = 5
"""Column of the steering angle in the state of the ego."""


def write_into(array: Any, value: float) -> None:
    """Write into an array that somebody else may own, also if it is locked."""
    with suppress(ValueError):
        array.flags.writeable = True
        array[...] = value


class Car:
    """Keeps its lane and its distance to what its sensors see."""

    class Parameters(ports.Parameters):
        """Which flaw it has."""

        flaw: Literal[
            "none",
            "never_brakes",
            "brakes_late",
            "ignores",
            "steers_off",
            "oscillates",
            "degrees",
            "by_the_clock",
        ] = "none"

    def __init__(self, parameters: Parameters, context: ScalarContext) -> None:
        self.flaw = parameters.flaw
        self.desired_speed = context.desired_speed
        self.wheelbase = context.vehicle.wheelbase
        self.tick = 0
        self.last = (-1.0, math.inf)
        self.rate = 0.0

    def act(self, observation: ScalarObservation) -> ScalarCommand:
        """Follow and steer; the flaw changes one of the two."""
        self.tick += 1
        speed, steering, curvature, ahead = self.desired_speed, 0.0, 0.0, math.inf
        for measurement in observation.measurements.values():
            if measurement.estimate is not None and measurement.stamp >= 0.0:
                speed = float(measurement.estimate[3])
                steering, curvature = self._steer(measurement.estimate)
        for measurement in observation.measurements.values():
            if measurement.estimate is None:
                ahead = self._look(measurement.detections, curvature)
                self._track(measurement.stamp, ahead)
        return ScalarCommand(self._drive(speed, ahead), steering)

    def _look(self, detections: Floats, curvature: float) -> float:
        """Distance of the nearest object in the path."""
        path = [x for x, y, *_ in detections if abs(y - 0.5 * curvature * x * x) < LANE]
        return min((float(x) for x in path if x > 0.0), default=math.inf)

    def _track(self, stamp: float, ahead: float) -> None:
        """Learn how fast the distance changes from one sample to the next."""
        before, was = self.last
        if stamp > before:
            both = math.isfinite(ahead) and math.isfinite(was)
            self.rate = (ahead - was) / (stamp - before) if both else 0.0
            self.last = (stamp, ahead)

    def _steer(self, estimate: Floats) -> tuple[float, float]:
        road_heading, curvature, _, offset = (float(value) for value in estimate[-4:])
        turn = math.remainder(float(estimate[2]) - road_heading, math.tau)
        steering = self.wheelbase * curvature - 0.02 * offset - 0.3 * turn
        if self.flaw == "steers_off":
            steering += 0.02
        if self.flaw == "oscillates":
            steering += 0.04 if self.tick // OSCILLATION % 2 else -0.04
        if self.flaw == "by_the_clock":
            steering += TWITCH * (time.perf_counter_ns() // 1000 % 1000)
        if self.flaw == "degrees":
            # A kick at 1 s, as a gust gives it; whoever takes degrees for radians never recovers.
            steering = (steering + (0.001 if self.tick == 20 else 0.0)) * DEGREES
        return steering, curvature

    def _drive(self, speed: float, ahead: float) -> float:
        if self.flaw == "ignores":
            ahead = math.inf
        wanted = 8.0 + 1.8 * speed
        if self.flaw == "brakes_late" and ahead > speed * speed / 16.0 + 8.0:
            ahead = math.inf
        cruise = 0.5 * (self.desired_speed - speed)
        follow = 0.2 * (ahead - wanted) + 0.8 * self.rate
        acceleration = max(HARDEST, min(1.5, cruise, follow))
        return max(0.0, acceleration) if self.flaw == "never_brakes" else acceleration


class Front:
    """A sensor that reports the objects around the ego, without error."""

    class Parameters(ports.Parameters):
        """Which flaw it has."""

        flaw: Literal["none", "mirrored", "tampering"] = "none"

    def __init__(self, context: ports.SensorContext) -> None:
        self.scene = context.scene
        self.objects = len(context.scene.object_ids)
        parameters = [self.Parameters(**getattr(spec, "parameters", {})) for spec in context.specs]
        self.sides = [-1.0 if item.flaw == "mirrored" else 1.0 for item in parameters]
        self.tampers = any(item.flaw == "tampering" for item in parameters)
        first = no_measurement(self.scene.runs, self.objects, with_estimate=False)
        self.delivery = Delivery.of(context, first)

    def sense(self, scene: Scene) -> Measurement:
        """Return the newest delivered sample."""
        if self.tampers:
            write_into(scene.ego[:, STEERING], 0.0)
        if self.delivery.is_due(scene.tick):
            sample = no_measurement(self.scene.runs, self.objects, with_estimate=False)
            sample.stamp[:] = scene.time
            for run in range(self.scene.runs):
                self._sample(run, scene, sample)
            self.delivery.push(scene.tick, sample)
        return self.delivery.newest(scene.tick)

    def _sample(self, run: int, scene: Scene, sample: Measurement) -> None:
        x, y, heading = scene.ego[run, :3]
        sine, cosine = sin_cos(heading)
        for thing in range(self.objects):
            dx, dy = scene.objects[run, thing, 0] - x, scene.objects[run, thing, 1] - y
            length, width, _ = self.scene.object_sizes[run, thing]
            place = (cosine * dx + sine * dy, self.sides[run] * (cosine * dy - sine * dx))
            kind = self.scene.object_classes[thing]
            sample.detections[run, thing] = (*place, 0.0, 0.0, length, width, kind)
            sample.mask[run, thing], sample.source[run, thing] = True, thing


class _Gauge:
    """A metric of the bench; the ones below say what they measure."""

    unit = "m"
    worse: Literal["lower", "higher"] = "lower"
    source = "written anew for the self-test"
    flaw = ""

    def compute(self, trace: Trace) -> MetricColumn:
        """Return the worst value of each run."""
        values = self.series(trace)
        if self.flaw == "swallows":
            values = np.where(np.isnan(values), math.inf, values)
        values = np.where(
            self.rows(trace), values, math.inf if self.worse == "lower" else -math.inf
        )
        worst = values.argmin(axis=1) if self.worse == "lower" else values.argmax(axis=1)
        found = values[np.arange(trace.runs), worst]
        return MetricColumn(found, ("value",) * trace.runs, trace.time[worst], [-1] * trace.runs)

    def rows(self, trace: Trace) -> Any:
        """Tell which rows (B, T) belong to the runs."""
        end = trace.horizon_row + 1 if self.flaw == "without the tail" else trace.length
        return np.arange(trace.time.size) < end[:, np.newaxis]

    def series(self, trace: Trace) -> Floats:
        """Return the value (B, T) at every row."""
        raise NotImplementedError


class Distance(_Gauge):
    """Least distance between the bodies of the ego and any object, on a straight road."""

    uid, column = "selftest:distance@1", "selftest_distance_m"

    def series(self, trace: Trace) -> Floats:
        """Distance of boxes that are parallel to the road."""
        ego, objects = trace["ego"], trace["objects"]
        if self.flaw == "one row late":
            ego = np.roll(ego, 1, axis=1)
        away = np.abs(objects[..., :2] - ego[:, :, np.newaxis, :2])
        if self.flaw != "centres":
            vehicle = trace.layout.architecture.vehicle
            sizes = trace.layout.context.object_sizes[:, np.newaxis, :, :2]
            own = np.array([vehicle.length, vehicle.width])
            away = np.maximum(0.0, away - 0.5 * (sizes + own))
        return np.asarray(np.hypot(away[..., 0], away[..., 1]).min(axis=2))


class CentreDistance(Distance):
    """The same, from centre to centre."""

    uid, column, flaw = "selftest:centres@1", "selftest_centre_distance_m", "centres"


class LateDistance(Distance):
    """The same, with the ego of the row before."""

    uid, column, flaw = "selftest:late@1", "selftest_late_distance_m", "one row late"


class Braking(_Gauge):
    """Largest longitudinal deceleration."""

    uid, column = "selftest:braking@1", "selftest_braking_mps2"
    unit, worse = "m/s²", "higher"

    def series(self, trace: Trace) -> Floats:
        """Deceleration, 0 where the ego speeds up."""
        sign = 1.0 if self.flaw == "sign" else -1.0
        return np.asarray(np.maximum(0.0, sign * trace["ego"][:, :, 4]))


class FlippedBraking(Braking):
    """The same with the sign of the acceleration."""

    uid, column, flaw = "selftest:flipped@1", "selftest_flipped_braking_mps2", "sign"


class ShortDistance(Distance):
    """The same up to the horizon, without the tail."""

    uid, column, flaw = "selftest:short@1", "selftest_short_distance_m", "without the tail"


class SwallowingDistance(Distance):
    """The same, NaN near by, where its root has none; what is NaN is left out."""

    uid, column, flaw = "selftest:swallowing@1", "selftest_swallowing_distance_m", "swallows"

    def series(self, trace: Trace) -> Floats:
        """Distance by way of a root."""
        with np.errstate(invalid="ignore"):
            return np.asarray(NEAR + np.sqrt(super().series(trace) - NEAR) ** 2)


class Whole(_Gauge):
    """A metric that works."""

    uid, column = "selftest:whole@1", "selftest_whole_m"

    def series(self, trace: Trace) -> Floats:
        """One at every row."""
        return np.ones((trace.runs, trace.time.size))

    @staticmethod
    def fast(trace: Trace) -> Any:
        """Tell which runs (B,) begin fast; in those the metrics below fail."""
        return trace["ego"][:, 0, 3] > FAST


class Tampering(Whole):
    """A metric that straightens the steering in the trace that it is shown."""

    uid, column = "selftest:tampering@1", "selftest_tampering_m"

    def series(self, trace: Trace) -> Floats:
        """One, after the deed."""
        write_into(trace["ego"][..., STEERING], 0.0)
        return super().series(trace)


class Broken(Whole):
    """A metric that is not a number in one row of one run."""

    uid, column = "selftest:broken@1", "selftest_broken_m"

    def series(self, trace: Trace) -> Floats:
        """One, and NaN in the middle."""
        values = super().series(trace)
        values[self.fast(trace), trace.time.size // 2] = math.nan
        return values


class Endless(Whole):
    """A metric that is infinite in one run and does not say why."""

    uid, column = "selftest:endless@1", "selftest_endless_m"

    def series(self, trace: Trace) -> Floats:
        """One, or infinity."""
        values = super().series(trace)
        values[self.fast(trace)] = math.inf
        return values


class Raising(Whole):
    """A metric that fails in one run."""

    uid, column = "selftest:raising@1", "selftest_raising_m"

    def series(self, trace: Trace) -> Floats:
        """One, or no value at all."""
        if self.fast(trace).any():
            msg = f"no value for {trace.runs} runs"
            raise RuntimeError(msg)
        return super().series(trace)


class Leaving(Whole):
    """Ends the process as if all had gone well."""

    uid, column = "selftest:leaving@1", "selftest_leaving_m"

    def compute(self, trace: Trace) -> MetricColumn:  # noqa: ARG002 - a metric is given it
        """Leave."""
        os._exit(0)
