"""Physical radar: echoes by the radar equation, detected in cells of range, bearing and rate."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import numpy as np

from adeye import signals
from adeye.delivery import insert, no_measurement, sample_at
from adeye.fields import fields_of
from adeye.kernel import sight
from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import atan2, exp, log, power, sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.random import normal, normal_pair, uniform
from adeye.signals import Floats, Ints, Measurement, Scene, parameter_record, spec_columns
from adeye.simulate.sensors.sampling import Found, Sampling, Stream, Truth, rear_axles, velocity_at
from adeye.simulate.world.objects import CROSS_SECTION
from adeye.simulate.world.weather import MM_PER_HOUR, NEPER, radar_rain_extinction

if TYPE_CHECKING:
    from adeye.ports import SensorContext
    from adeye.spec.sensors import PhysicalRadar

# --- What decides whether a 77 GHz radar detects an object: echo, noise, rain and threshold -------

RAIN_ECHO_A: Final = 1.354e-4
RAIN_ECHO_B: Final = 0.682
"""Radar cross section of rain per volume at 77 GHz, a·R^b [m²/m³] with R [mm/h]. Computed for
spheres (Mie 1908) with the drop sizes of Marshall & Palmer (1948) and the permittivity of water at
20 °C of Liebe, Hufford & Manabe (1991), and fitted from 1 to 100 mm/h, within 17 %."""

LEAST_SIGNAL: Final = 1e-3
"""Signal-to-noise ratio below which an echo is left out: what it adds to noise decides nothing."""


@compiled
def decibels(level: float) -> float:
    """Return the ratio that a level is [dB]."""
    return exp(level / NEPER)


@compiled
def detection_threshold(false_alarm_rate: float) -> float:
    """Return the power above which a cell counts as a detection, in units of the mean noise.

    The power of noise alone is exponentially distributed.

    Args:
        false_alarm_rate: Probability that noise crosses the threshold in one cell, below 1.

    Source:
        Richards (2014), "Fundamentals of radar signal processing", 2nd ed., chapter 6.
    """
    return -log(false_alarm_rate)


@compiled
def signal_for(probability: float, false_alarm_rate: float) -> float:
    """Return the mean signal-to-noise ratio at which a fluctuating target is so often detected.

    Signal and noise of a Swerling 1 target have an exponentially distributed power of mean
    1 + SNR, so P_d = P_fa^(1/(1 + SNR)), solved for the SNR here.

    Args:
        probability: Of detection, between the false-alarm rate and 1.
        false_alarm_rate: Of one cell.

    Source:
        Swerling (1960), "Probability of detection for fluctuating targets", IRE Trans. IT-6, for
        one pulse (here one frame).
    """
    return log(false_alarm_rate) / log(probability) - 1.0


@compiled
def rain_echo(rain: float) -> float:
    """Return the radar cross section of rain per volume [m²/m³].

    Args:
        rain: [m/s].
    """
    if not rain > 0.0:
        return 0.0
    return RAIN_ECHO_A * power(rain / MM_PER_HOUR, RAIN_ECHO_B)


@inlined
def signal_to_noise(  # noqa: PLR0913, PLR0917 - a kernel
    strength: float,
    cross_section: float,
    distance: float,
    bearing: float,
    beam: float,
    extinction: float,
    rain_in_cell: float,
) -> float:
    """Return the mean power of an echo over that of noise and of the rain in its cell.

    The radar equation: both ways through the antenna's Gaussian beam and through the rain, spread
    with the fourth power of the distance. The rain in the cell grows with its volume, which is
    proportional to the distance squared. All of it counts as if it fell at the target's range rate,
    which is the worst case.

    Args:
        strength: Signal-to-noise ratio of 1 m² at 1 m on the boresight in clear air.
        cross_section: Of what is seen of the object [m²].
        distance: [m], positive.
        bearing: From the boresight [rad].
        beam: Two-way loss per bearing squared, in nepers of the power [1/rad²].
        extinction: One way [1/m].
        rain_in_cell: Cross section of the rain in the cell per distance squared [m²/m²].

    Source:
        Skolnik (2008), "Radar handbook", 3rd ed.: the radar equation, echoes of rain.
    """
    square = distance * distance
    loss = beam * bearing * bearing + 2.0 * extinction * distance
    # Without a loss the exponential is 1, which is not worth asking for.
    gain = strength * exp(-loss) if loss > 0.0 else strength
    return gain * cross_section / (square * square + gain * rain_in_cell * square)


@inlined
def facing(along: float, across: float, half: float) -> float:
    """Return how squarely a face looks at the sensor: the squared cosine of its incidence.

    Args:
        along: Place of the sensor in the frame of the box, at right angles to the face [m].
        across: Along the face, from its middle [m].
        half: Half of the size of the box, at right angles to the face [m].

    Returns:
        0 if the sensor is not before the face, 1 straight before its middle.
    """
    before = abs(along) - half
    if not before > 0.0:
        return 0.0
    return before * before / (before * before + across * across)


def cross_sections(classes: Ints) -> Floats:
    """Return the cross sections (M, 2) of the ends and the sides of objects [m²].

    Args:
        classes: (M,) index into ``OBJECT_CLASSES``.
    """
    known = np.array(
        [[decibels(level) for level in CROSS_SECTION[name]] for name in signals.OBJECT_CLASSES]
    )
    return np.ascontiguousarray(known[classes])


# --- From the echoes of a radar to its detections: cells, threshold, errors, false alarms,
# clutter.

# Columns of an echo, and of a detection.
(
    ECHO_SIGNAL,  # mean signal-to-noise ratio, 0 for none
    ECHO_RANGE,  # [m]
    ECHO_BEARING,  # from the boresight [rad]
    ECHO_RATE,  # [m/s]
    ECHO_X,  # place in the vehicle frame, of a detection only [m]
    ECHO_Y,
) = range(6)
ECHO_WIDTH: Final = 6

DRAWS: Final = 3
"""Random numbers per object and sample: fluctuation; range and bearing; range rate."""

FIRST_GHOST: Final = 1 << 24
"""Where the random numbers of false alarms and clutter begin: behind those of every object, so that
another object leaves them as they were."""

FINEST: Final = 0.05
"""Standard deviation that no echo is strong enough to fall below, in cells: calibration and the
extent of objects, which signal-to-noise ratio does not improve. Our choice."""


@inlined
def same_cell(parameters: Any, one: Floats, other: Floats) -> bool:
    """Tell whether two echoes are too near each other in range, bearing and rate to be told apart.

    Cells have no fixed edges: what counts is the difference.
    """
    if not abs(one[ECHO_RANGE] - other[ECHO_RANGE]) < parameters["range_resolution"]:
        return False
    if not abs(one[ECHO_RATE] - other[ECHO_RATE]) < parameters["range_rate_resolution"]:
        return False
    apart = wrap_to_pi(one[ECHO_BEARING] - other[ECHO_BEARING])
    return bool(abs(apart) < parameters["bearing_resolution"])


@inlined
def folded(rate: float, most: float) -> float:
    """Return the range rate that a chirp sequence shows for a true one [m/s], in [-most, most).

    Args:
        rate: [m/s].
        most: Half of the span that it can tell apart [m/s].
    """
    if -most <= rate < most:
        return rate
    span = 2.0 * most
    return rate - span * math.floor((rate + most) / span)


@inlined
def _gather(parameters: Any, echoes: Floats) -> int:
    """Join the strongest echo that is left with all in its cell, and return its object, or -1.

    Echoes of one cell add in power, because their phases are independent; the sum lies at their
    mean, weighted with the power. So a weak object beside a strong one is not seen on its own.

    Args:
        parameters: Record of the sensor.
        echoes: (M, ECHO_WIDTH) in and out: what is joined has no signal any more.
    """
    strongest = -1
    most = 0.0
    for thing in range(echoes.shape[0]):
        if echoes[thing, ECHO_SIGNAL] > most:
            strongest, most = thing, echoes[thing, ECHO_SIGNAL]
    if strongest < 0:
        return -1
    peak = echoes[strongest]
    signal = away = aside = faster = 0.0
    for thing in range(echoes.shape[0]):
        echo = echoes[thing]
        share = echo[ECHO_SIGNAL]
        if thing == strongest or not share > 0.0 or not same_cell(parameters, peak, echo):
            continue
        signal += share
        away += share * (echo[ECHO_RANGE] - peak[ECHO_RANGE])
        aside += share * wrap_to_pi(echo[ECHO_BEARING] - peak[ECHO_BEARING])
        faster += share * (echo[ECHO_RATE] - peak[ECHO_RATE])
        echo[ECHO_SIGNAL] = 0.0
    if signal > 0.0:
        total = most + signal
        peak[ECHO_SIGNAL] = total
        peak[ECHO_RANGE] += away / total
        peak[ECHO_BEARING] += aside / total
        peak[ECHO_RATE] += faster / total
    return strongest


@inlined
def _received(parameters: Any, stream: Stream, thing: int, signal: float) -> float:
    """Draw the power of a cell in units of the mean noise; 0 if it stays below the threshold.

    Echo and noise of a fluctuating (Swerling 1) target have an exponentially distributed power.
    """
    chance = uniform(stream.seed, stream.owner, stream.number, DRAWS * thing)
    received = -(1.0 + signal) * log(chance)
    return received if received > parameters["threshold"] else 0.0


@inlined
def detect(
    parameters: Any,
    stream: Stream,
    echoes: Floats,
    order: Ints,
) -> int:
    """Join the echoes of each cell and keep those that cross the threshold, with their errors.

    Args:
        parameters: Record of the sensor.
        stream: Of the run.
        echoes: (M, ECHO_WIDTH) of objects in, of detections out.
        order: (>= M,) out: the detections, nearest first.

    Returns:
        Number of detections.
    """
    count = 0
    while True:
        thing = _gather(parameters, echoes)
        if thing < 0:
            return count
        signal = echoes[thing, ECHO_SIGNAL]
        echoes[thing, ECHO_SIGNAL] = 0.0
        # The rest is weaker still.
        if not signal > LEAST_SIGNAL:
            return count
        received = _received(parameters, stream, thing, signal)
        if received > 0.0:
            first = DRAWS * thing + 1
            _measure(parameters, stream, first, received, echoes[thing])
            x, y = echoes[thing, ECHO_X], echoes[thing, ECHO_Y]
            insert(order, echoes[:, ECHO_X:], count, thing, x * x + y * y)
            count += 1


@inlined
def _measure(
    parameters: Any,
    stream: Stream,
    first: int,
    received: float,
    echo: Floats,
) -> None:
    """Add the errors of measurement, resolution / sqrt(2·SNR) of each, and place the detection.

    Args:
        parameters: Record of the sensor.
        stream: Of the run.
        first: Index of the first of two draws.
        received: Power in units of the mean noise.
        echo: (ECHO_WIDTH,) in and out.

    Source:
        Curry (2005), "Radar system performance modeling", 2nd ed.: resolution / sqrt(2·SNR), here
        with a constant of 1 for all three; what the power of this sample is, not its mean, decides.
    """
    sigma = max(FINEST, 1.0 / math.sqrt(2.0 * received))
    along, aside = normal_pair(stream.seed, stream.owner, stream.number, first)
    faster = normal(stream.seed, stream.owner, stream.number, first + 1)
    echo[ECHO_RANGE] += sigma * parameters["range_resolution"] * along
    echo[ECHO_BEARING] += sigma * parameters["bearing_resolution"] * aside
    rate = echo[ECHO_RATE] + sigma * parameters["range_rate_resolution"] * faster
    echo[ECHO_RATE] = folded(rate, parameters["max_range_rate"])
    _place(parameters, echo)


@inlined
def _place(parameters: Any, echo: Floats) -> None:
    """Place a detection in the vehicle frame."""
    s, c = sin_cos(parameters["yaw"] + echo[ECHO_BEARING])
    echo[ECHO_X] = parameters["x"] + echo[ECHO_RANGE] * c
    echo[ECHO_Y] = parameters["y"] + echo[ECHO_RANGE] * s


@inlined
def count_events(mean: float, none: float, most: float, chance: float) -> int:
    """Return a Poisson distributed number, by the inverse of its distribution function.

    Args:
        mean: Of the distribution, positive.
        none: Probability of 0, exp(-mean).
        most: Greatest number that is returned.
        chance: Uniform draw.
    """
    count = 0
    probability = total = none
    while chance > total and count < most:
        count += 1
        probability *= mean / count
        total += probability
    return count


def most_events(mean: float) -> int:
    """Return a number that a Poisson distributed one exceeds less than once in 10^7 times."""
    return int(mean + 6.0 * math.sqrt(mean) + 4.0) if mean > 0.0 else 0


@inlined
def add_ghosts(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    stream: Stream,
    velocity: tuple[float, float],
    objects: int,
    count: int,
    echoes: Floats,
    order: Ints,
) -> int:
    """Add false alarms and clutter to the detections of objects.

    A false alarm lies in any cell, whatever its range. Clutter is spread over the area in view and
    stands still in the world; it is weak, so in the cell of an object it is part of that echo.

    Args:
        parameters: Record of the sensor.
        stream: Of the run.
        velocity: Of the sensor along and across its boresight [m/s].
        objects: M.
        count: Detections so far.
        echoes: (K, ECHO_WIDTH) in and out; ghosts have the rows from M on.
        order: (K,) in and out: the detections, nearest first.

    Returns:
        Number of detections.
    """
    ghosts = count_events(
        parameters["ghosts"],
        parameters["no_ghost"],
        parameters["most_ghosts"],
        uniform(stream.seed, stream.owner, stream.number, FIRST_GHOST),
    )
    most = parameters["max_range_rate"]
    for event in range(ghosts):
        first = FIRST_GHOST + 4 * (event + 1)
        ghost = echoes[objects + event]
        ghost[ECHO_RANGE] = parameters["range"] * uniform(
            stream.seed, stream.owner, stream.number, first
        )
        aside = 2.0 * uniform(stream.seed, stream.owner, stream.number, first + 1) - 1.0
        ghost[ECHO_BEARING] = parameters["half_view"] * aside
        if (
            uniform(stream.seed, stream.owner, stream.number, first + 2)
            < parameters["clutter_share"]
        ):
            ghost[ECHO_RANGE] = math.sqrt(parameters["range"] * ghost[ECHO_RANGE])
            s, c = sin_cos(ghost[ECHO_BEARING])
            sigma = parameters["range_rate_resolution"] / math.sqrt(2.0 * parameters["threshold"])
            rate = sigma * normal(stream.seed, stream.owner, stream.number, first + 3)
            rate -= velocity[0] * c + velocity[1] * s
            ghost[ECHO_RATE] = folded(rate, most)
        else:
            ghost[ECHO_RATE] = most * (
                2.0 * uniform(stream.seed, stream.owner, stream.number, first + 3) - 1.0
            )
        count = _take_ghost(parameters, objects + event, count, echoes, order)
    return count


@inlined
def _take_ghost(parameters: Any, ghost: int, count: int, echoes: Floats, order: Ints) -> int:
    """Insert a ghost unless its cell has a detection; return the number of detections."""
    for row in range(count):
        if same_cell(parameters, echoes[order[row]], echoes[ghost]):
            return count
    _place(parameters, echoes[ghost])
    x, y = echoes[ghost, ECHO_X], echoes[ghost, ECHO_Y]
    insert(order, echoes[:, ECHO_X:], count, ghost, x * x + y * y)
    return count + 1


# --- Physical radar: echoes by the radar equation, detected in cells of range, bearing and rate ---

NOTHING_KNOWN: Final = -1.0
"""Class of a detection: a radar does not tell what it is."""


class Memory(NamedTuple):
    """What a radar knows of the objects, and scratch for a run.

    Attributes:
        cross_sections: (M, 2) of ends and sides [m²].
        pieces: (M, 2) scratch.
        looks: (M, OUTLINE_WIDTH) scratch.
        echoes: (K, ECHO_WIDTH) scratch.
        order: (K,) scratch: the detections, nearest first.
    """

    cross_sections: Floats
    pieces: Floats
    looks: Floats
    echoes: Floats
    order: Ints


class RadarSensor(Sampling):
    """A radar that reports points with a range rate, and now and then one that is not there.

    Plan view: neither ground nor elevation takes part, and there is one path to each object, so it
    does not see beneath a truck what drives ahead of it.
    """

    def __init__(self, context: SensorContext) -> None:
        """Pack the parameters of every run."""
        scene = context.scene
        specs = [cast("PhysicalRadar", spec) for spec in context.specs]
        columns = spec_columns(specs, _numbers)
        rain = scene.surroundings.rain
        volume = columns.pop("cell_volume") * np.array([rain_echo(each) for each in rain])
        self._parameters = parameter_record(
            {
                **columns,
                "extinction": np.array([radar_rain_extinction(each) for each in rain]),
                "rain_in_cell": volume,
                "rear": rear_axles(context),
            }
        )
        objects = len(scene.object_ids)
        self._rows = objects + int(columns["most_ghosts"].max())
        self._memory = Memory(
            cross_sections(scene.object_classes),
            np.zeros((objects, 2)),
            np.zeros((objects, sight.OUTLINE_WIDTH)),
            np.zeros((self._rows, ECHO_WIDTH)),
            np.zeros(self._rows, dtype=np.int64),
        )
        super().__init__(context, no_measurement(scene.runs, self._rows, with_estimate=False))

    def _sample(self, scene: Scene) -> Measurement:
        sample = sample_at(scene.time, self._context.scene.runs, self._rows)
        _sample_batch(self._parameters, self._truth(scene), self._memory, Found.of(sample))
        return sample


def _numbers(spec: PhysicalRadar) -> dict[str, float]:
    """List what the compiled step reads of a radar; both edges are 0 from half a turn on."""
    angle = spec.field_of_view
    half = 0.5 * angle
    sine, cosine = sin_cos(half) if angle < math.pi else (0.0, 0.0)
    square = spec.range * spec.range
    signal = signal_for(0.5, spec.false_alarm_rate)
    # Two Poisson distributed numbers add up to one, of which each event is of either kind.
    ghosts = spec.false_alarm_rate * spec.cells + spec.clutter
    return {
        **fields_of(spec.mount, "x", "y", "yaw"),
        "half_view": half,
        "edge_sine": sine,
        "edge_cosine": cosine,
        "range": spec.range,
        "strength": signal * square * square / spec.reference_cross_section,
        "threshold": detection_threshold(spec.false_alarm_rate),
        "beam": 2.0 * spec.edge_loss / NEPER / (half * half),
        **fields_of(spec, "range_resolution", "bearing_resolution"),
        **fields_of(spec, "range_rate_resolution", "max_range_rate"),
        "cell_volume": spec.range_resolution * spec.bearing_resolution * spec.elevation_beam,
        "ghosts": ghosts,
        "no_ghost": exp(-ghosts),
        "most_ghosts": most_events(ghosts),
        "clutter_share": spec.clutter / ghosts,
    }


@compiled
def _sample_batch(parameters: Any, truth: Truth, memory: Memory, found: Found) -> None:
    """Sample every run of a batch: empty where it has ended.

    Args:
        parameters: (B,) records of the sensor's parameters and the weather.
        truth: What is true.
        memory: Scratch.
        found: Out.
    """
    objects = truth.objects.shape[1]
    for run in range(truth.running.shape[0]):
        if not truth.running[run]:
            continue
        count = _sample_run(parameters[run], truth, run, memory)
        for row in range(count):
            thing = memory.order[row]
            echo, detection = memory.echoes[thing], found.detections[run, row]
            found.mask[run, row] = True
            found.source[run, row] = thing if thing < objects else -1
            detection[signals.DETECTION_X] = echo[ECHO_X]
            detection[signals.DETECTION_Y] = echo[ECHO_Y]
            detection[signals.DETECTION_RANGE_RATE] = echo[ECHO_RATE]
            detection[signals.DETECTION_HAS_RANGE_RATE] = 1.0
            detection[signals.DETECTION_CLASS] = NOTHING_KNOWN


@inlined
def _sample_run(parameters: Any, truth: Truth, run: int, memory: Memory) -> int:
    """Detect in one run, see ``_sample_batch``; return the number of detections.

    The sensor moves with the ego: with its rear axle, and around that as the ego turns.
    """
    ego, objects, sizes = truth.ego[run], truth.objects[run], truth.sizes[run]
    looks, echoes = memory.looks, memory.echoes
    s, c = sin_cos(ego[signals.EGO_HEADING])
    lever_x = c * parameters["x"] - s * parameters["y"]
    lever_y = s * parameters["x"] + c * parameters["y"]
    forward, aside = velocity_at(ego, parameters["x"] + parameters["rear"], parameters["y"])
    velocity_x, velocity_y = forward * c - aside * s, forward * s + aside * c
    ahead_y, ahead_x = sin_cos(ego[signals.EGO_HEADING] + parameters["yaw"])
    count = objects.shape[0]
    for thing in range(count):
        sight.sight(
            ego[signals.EGO_X] + lever_x,
            ego[signals.EGO_Y] + lever_y,
            objects[thing],
            sizes[thing],
            looks[thing],
        )
    for thing in range(count):
        echoes[thing, ECHO_SIGNAL] = 0.0
        if not _may_echo(parameters, ahead_x, ahead_y, looks[thing]):
            continue
        sight.find_shape(sizes[thing], looks[thing])
        _find_echo(
            parameters,
            (ahead_x, ahead_y),
            (velocity_x, velocity_y),
            objects[thing],
            sizes[thing],
            memory.cross_sections[thing],
            looks[thing],
            echoes[thing],
        )
        # Who is too weak anyway need not be looked for behind others.
        if echoes[thing, ECHO_SIGNAL] > LEAST_SIGNAL:
            share = sight.visible_share(thing, ahead_x, ahead_y, sizes, looks, memory.pieces)
            echoes[thing, ECHO_SIGNAL] *= share
    stream = Stream(truth.seeds[run], truth.owner, truth.number)
    found = detect(parameters, stream, echoes[:count], memory.order)
    forward = ahead_x * velocity_x + ahead_y * velocity_y
    sideways = ahead_x * velocity_y - ahead_y * velocity_x
    return add_ghosts(parameters, stream, (forward, sideways), count, found, echoes, memory.order)


@inlined
def _may_echo(parameters: Any, ahead_x: float, ahead_y: float, look: Floats) -> bool:
    """Tell whether a circle around a box reaches into the field of view; spares what is dearer."""
    sine, cosine = parameters["edge_sine"], parameters["edge_cosine"]
    along = ahead_x * look[sight.DX] + ahead_y * look[sight.DY]
    across = ahead_x * look[sight.DY] - ahead_y * look[sight.DX]
    return not (sine > 0.0 and abs(across) * cosine - along * sine > look[sight.HALF])


@inlined
def _find_echo(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    ahead: tuple[float, float],
    velocity: tuple[float, float],
    target: Floats,
    size: Floats,
    cross_section: Floats,
    look: Floats,
    echo: Floats,
) -> None:
    """Find the mean echo of one box, as if nothing hid it.

    It has two centres of reflection, the middles of the end and of the side that face the sensor;
    each returns its cross section times the squared cosine of the incidence, and the echo lies at
    their mean, weighted with that.

    Args:
        parameters: Record of the sensor.
        ahead: Unit vector of the boresight.
        velocity: Of the sensor [m/s].
        target: (5,) state.
        size: (3,).
        cross_section: (2,) of its ends and its sides [m²].
        look: (OUTLINE_WIDTH,) of the box.
        echo: (ECHO_WIDTH,) out; no signal where there is none, from inside the box for one.
    """
    dx, dy, c, s = look[sight.DX], look[sight.DY], look[sight.COSINE], look[sight.SINE]
    along, across = dx * c + dy * s, dy * c - dx * s
    end = cross_section[0] * facing(along, across, 0.5 * size[0])
    side = cross_section[1] * facing(across, along, 0.5 * size[1])
    if look[sight.INSIDE] > 0.0 or not end + side > 0.0:
        return
    near = math.copysign(0.5 * size[0], along) * end / (end + side)
    beside = math.copysign(0.5 * size[1], across) * side / (end + side)
    x, y = dx - near * c + beside * s, dy - near * s - beside * c
    distance = math.sqrt(x * x + y * y)
    if not distance > 0.0:
        return
    bearing = atan2(ahead[0] * y - ahead[1] * x, ahead[0] * x + ahead[1] * y)
    if not abs(bearing) <= parameters["half_view"]:
        return
    echo[ECHO_SIGNAL] = signal_to_noise(
        parameters["strength"],
        end + side,
        # Nearer than one cell the fourth power means nothing any more.
        max(distance, parameters["range_resolution"]),
        bearing,
        parameters["beam"],
        parameters["extinction"],
        parameters["rain_in_cell"],
    )
    echo[ECHO_RANGE], echo[ECHO_BEARING] = distance, bearing
    rate = (target[signals.OBJECT_SPEED] * c - velocity[0]) * x
    rate += (target[signals.OBJECT_SPEED] * s - velocity[1]) * y
    echo[ECHO_RATE] = folded(rate / distance, parameters["max_range_rate"])
