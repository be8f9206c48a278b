"""A sensor that an FMU is: told of the objects around the sensor, it answers with detections.

What it is told is true, and so is where it is mounted; what it makes of that is its own. The FMU
runs in a process of its own in each run, see ``bridges.fmus``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple, NoReturn

import numpy as np

from adeye import signals
from adeye.delivery import insert, no_measurement, sample_at
from adeye.errors import PluginError
from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled
from adeye.kernel.random import uniform
from adeye.signals import Floats, Ints, Measurement, Scene
from adeye.simulate.bridges.fmus import Fmus, Step, Wired, wire_each, wire_fmu
from adeye.simulate.bridges.programs import INVALID_OUTPUT, Broken
from adeye.simulate.sensors.sampling import Sampling, Truth, rear_axles, velocity_at
from adeye.spec.sensors import MOST_SENSED, SENSED, SENSED_OBJECT
from adeye.units import Dimension, shown

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.ports import SensorContext
    from adeye.spec.sensors import FmuSensor

DETECTION: Final = {
    "present": Dimension.NONE,
    "x": Dimension.LENGTH,
    "y": Dimension.LENGTH,
    "range_rate": Dimension.SPEED,
    "length": Dimension.LENGTH,
    "width": Dimension.LENGTH,
    "object": Dimension.NONE,
}
"""What the numbers of a detection measure."""

PRESENT, X, Y, VX, VY, HEADING, LENGTH, WIDTH, HEIGHT, CLASS = range(len(SENSED_OBJECT))

SEED_DRAW: Final = 0
"""Number of the draw that the seed of a run's FMU is made of; no other is made."""


def wire_sensor(sensor: FmuSensor, base_dir: Path) -> Wired:
    """Read the description of a sensor's FMU and connect its variables.

    Raises:
        InputError: fmpy is not installed.
        SpecError: There is no such FMU, or its variables do not fit.
    """
    return wire_fmu(
        sensor,
        base_dir,
        [(signal, name, SENSED[signal]) for name, signal in sorted(sensor.inputs.items())],
        [
            (f"{number}.{key}", variable, what)
            for number, detection in enumerate(sensor.detections)
            for key, what in DETECTION.items()
            if (variable := getattr(detection, key)) is not None
        ],
        [] if sensor.seed is None else [("seed", sensor.seed, Dimension.NONE)],
    )


class Look(NamedTuple):
    """What is around the sensors of a batch.

    Attributes:
        objects: (B, MOST_SENSED, 10) of the nearest ones, see ``spec.sensors.SENSED_OBJECT``.
        numbers: (B, MOST_SENSED) which object of the scene each is, -1 for none.
    """

    objects: Floats
    numbers: Ints


class FmuSensing(Sampling):
    """Asks the FMU of each run for detections at each sample.

    It is initialised with the first sample's inputs; from then on each sample sets the inputs and
    steps the FMU from the time of the sample before to its own.
    """

    def __init__(self, context: SensorContext, base_dir: Path) -> None:
        """Prepare for a batch; the FMUs are started by the first sample."""
        specs: list[Any] = list(context.specs)
        self._specs: list[FmuSensor] = specs
        self._base_dir = base_dir
        self._slots = self._specs[0].slots
        self._rear = rear_axles(context)
        poses = [spec.mount for spec in self._specs]
        self._mounts = np.array([[pose.x, pose.y, pose.yaw] for pose in poses])
        runs, things = context.scene.runs, len(context.scene.object_ids)
        self._scratch = np.zeros((things, 2)), np.zeros(things, dtype=np.int64)
        self._look = Look(
            np.zeros((runs, MOST_SENSED, len(SENSED_OBJECT))),
            np.full((runs, MOST_SENSED), -1, dtype=np.int64),
        )
        self._wired: list[Wired] = []
        self._fmus: Fmus | None = None
        self._sampled = 0.0
        super().__init__(context, no_measurement(runs, self._slots, with_estimate=False))

    def close(self) -> None:
        """End every FMU and wait until they have."""
        if self._fmus is not None:
            self._fmus.close()
            self._fmus = None

    def _sample(self, scene: Scene) -> Measurement:
        """Step every FMU to the present and read what it detects.

        Raises:
            SpecError: There is no such FMU, or its variables do not fit.
            PluginError: An FMU failed: what the sensor would have delivered is not known.
        """
        fmus = self._fmus or self._start()
        truth = self._truth(scene)
        _look_around(truth, self._mounts, self._rear, *self._scratch, self._look)
        told = self._told(scene)
        begin = scene.time if self._sample_number == 0 else self._sampled
        self._sampled = scene.time
        asked: dict[int, Step] = {}
        for run, is_running in enumerate(scene.running):
            if not is_running:
                fmus.end(run)
                continue
            values = [float(told[wire.signal][run]) for wire in self._wired[run].inputs]
            asked[run] = Step(values, begin, scene.time - begin, is_before=True)
        sample = sample_at(scene.time, len(scene.running), self._slots)
        for run, found in fmus.step(asked).items():
            if isinstance(found, Broken):
                self._fail(run, found, scene.time)
            outputs = zip(self._wired[run].outputs, found, strict=True)
            answered = {wire.signal: value for wire, value in outputs}
            if nonsense := self._nonsense(answered, self._look.numbers[run]):
                self._fail(run, Broken(INVALID_OUTPUT, nonsense), scene.time)
            self._write(run, answered, sample)
        return sample

    def _start(self) -> Fmus:
        """Read the FMUs and start them, each with the seed of its run."""
        self._wired = wire_each(self._specs, lambda spec: wire_sensor(spec, self._base_dir))
        seeds = self._context.scene.stream_seeds
        starts = []
        for wired, seed in zip(self._wired, seeds, strict=True):
            drawn = int(uniform(seed, self._owner, 0, SEED_DRAW) * 2**31)
            starts.append({wire.variable: drawn for wire in wired.initial})
        self._fmus = Fmus(self._specs, self._wired, starts)
        for run, broken in self._fmus.greet().items():
            self._fail(run, broken, 0.0)
        return self._fmus

    def _told(self, scene: Scene) -> dict[str, Floats]:
        """Return each signal of all runs by name, in SI, see ``spec.sensors.SENSED``."""
        around = self._context.scene.surroundings
        named: dict[str, Floats] = {
            "time": np.full(len(scene.ego), scene.time),
            "ego.speed": scene.ego[:, signals.EGO_SPEED],
            "ego.acceleration": scene.ego[:, signals.EGO_ACCELERATION],
            "ego.yaw_rate": scene.ego[:, signals.EGO_YAW_RATE],
            "environment.rain": around.rain,
            "environment.fog_visibility": around.fog_visibility,
            "environment.illuminance": around.illuminance,
        }
        for row in range(MOST_SENSED):
            for column, name in enumerate(SENSED_OBJECT):
                named[f"objects.{row + 1}.{name}"] = self._look.objects[:, row, column]
        return named

    def _nonsense(self, told: dict[str, float], numbers: Ints) -> str:
        """Say what no detection can be like; empty for nothing."""
        known = int(np.count_nonzero(numbers >= 0))
        for slot in range(self._slots):
            if told[f"{slot}.present"] <= 0.5:
                continue
            for name in ("length", "width"):
                if (size := told.get(f"{slot}.{name}", 0.0)) < 0.0:
                    return f"{name} of detection {slot + 1} is {size:g} m"
            number = told.get(f"{slot}.object", 0.0)
            if number not in range(known + 1):
                return (
                    f"object of detection {slot + 1} is {number:g}; it is told of {known}, and 0 "
                    "is none"
                )
        return ""

    def _write(self, run: int, told: dict[str, float], sample: Measurement) -> None:
        """Write the detections of a run in order of increasing distance."""
        numbers = self._look.numbers[run]
        x, y, yaw = self._mounts[run]
        sine, cosine = sin_cos(yaw)
        rows = []
        for slot in range(self._slots):
            if told[f"{slot}.present"] <= 0.5:
                continue
            ahead, aside = told[f"{slot}.x"], told[f"{slot}.y"]
            rate = told.get(f"{slot}.range_rate")
            place = x + cosine * ahead - sine * aside, y + sine * ahead + cosine * aside
            row = [
                *place,
                rate or 0.0,
                0.0 if rate is None else 1.0,
                told.get(f"{slot}.length", 0.0),
                told.get(f"{slot}.width", 0.0),
                -1.0,
            ]
            number = round(told.get(f"{slot}.object", slot + 1)) - 1
            source = int(numbers[number]) if 0 <= number < MOST_SENSED else -1
            rows.append((place[0] ** 2 + place[1] ** 2, slot, row, source))
        for at, (_, _, row, source) in enumerate(sorted(rows)):
            sample.mask[run, at] = True
            sample.detections[run, at] = row
            sample.source[run, at] = source

    def _fail(self, run: int, broken: Broken, time: float) -> NoReturn:
        name = shown(self._specs[run].file)
        raise PluginError(
            f"sensors.{self._context.sensor_id}: {name} failed at {time:g} s: {broken.cause}: "
            f"{broken.detail}. What it would have delivered is not known: mend the FMU. A sensor "
            "that falls silent is a fault"
        )


@compiled
def _look_around(
    truth: Truth, mounts: Floats, rear: Floats, places: Floats, order: Ints, look: Look
) -> None:
    """List the objects nearest to each sensor, against the sensor and in its frame.

    Args:
        truth: What is true; where a run has ended nothing is listed.
        mounts: (B, 3) x, y, yaw in the vehicle frame.
        rear: (B,) how far the rear axle is behind the ego's box centre [m].
        places: (M, 2) scratch: place of each.
        order: (M,) scratch.
        look: Out.
    """
    for run in range(truth.running.shape[0]):
        look.objects[run] = 0.0
        look.numbers[run] = -1
        if not truth.running[run]:
            continue
        ego, mount = truth.ego[run], mounts[run]
        s, c = sin_cos(ego[signals.EGO_HEADING])
        x = ego[signals.EGO_X] + c * mount[0] - s * mount[1]
        y = ego[signals.EGO_Y] + s * mount[0] + c * mount[1]
        forward, aside = velocity_at(ego, rear[run] + mount[0], mount[1])
        own_x, own_y = forward * c - aside * s, forward * s + aside * c
        looks = ego[signals.EGO_HEADING] + mount[2]
        s, c = sin_cos(looks)
        for thing in range(truth.objects.shape[1]):
            state = truth.objects[run, thing]
            dx, dy = state[signals.OBJECT_X] - x, state[signals.OBJECT_Y] - y
            places[thing, 0], places[thing, 1] = c * dx + s * dy, -s * dx + c * dy
            insert(order, places, thing, thing, dx * dx + dy * dy)
        for row in range(min(truth.objects.shape[1], MOST_SENSED)):
            thing = order[row]
            state, told = truth.objects[run, thing], look.objects[run, row]
            sine, cosine = sin_cos(state[signals.OBJECT_HEADING])
            vx = state[signals.OBJECT_SPEED] * cosine - own_x
            vy = state[signals.OBJECT_SPEED] * sine - own_y
            look.numbers[run, row] = thing
            told[PRESENT], told[X], told[Y] = 1.0, places[thing, 0], places[thing, 1]
            told[VX], told[VY] = c * vx + s * vy, -s * vx + c * vy
            told[HEADING] = wrap_to_pi(state[signals.OBJECT_HEADING] - looks)
            told[LENGTH], told[WIDTH] = truth.sizes[run, thing, 0], truth.sizes[run, thing, 1]
            told[HEIGHT] = truth.sizes[run, thing, 2]
            told[CLASS] = truth.classes[thing]
