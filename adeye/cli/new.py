"""``new channel|sensor|metric`` and ``init``: write a working example to start from."""

from __future__ import annotations

import keyword
import re
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import Annotated, Final

import typer

from adeye.cli.options import add
from adeye.cli.output import clean, emit, wrote

# --- ``new channel|sensor|metric``: write a working example to start from -------------------------

_NAME: Final = re.compile(r"[a-z][a-z0-9_]{0,63}")

new_app = typer.Typer(
    help="Write a working example of a part of your own: it runs as it is.", no_args_is_help=True
)

PartName = Annotated[
    str, typer.Argument(metavar="NAME", help="Its name: lower case, digits, underscores.")
]
Folder = Annotated[
    Path | None,
    typer.Option(
        "--path",
        metavar="DIR",
        envvar="ADEYE_PATH",
        help="Folder that it is put into, by default that of the files that name it.",
    ),
]


def new_channel(name: PartName, path: Folder = None) -> None:
    """Write a control channel: one Python object per run that answers what it observes."""
    write_example("channel", name, path or usual_folder("channel"))


def new_sensor(name: PartName, path: Folder = None) -> None:
    """Write a sensor: ground truth in, measurements out, at a rate and a latency."""
    write_example("sensor", name, path or usual_folder("sensor"))


def new_metric(name: PartName, path: Folder = None) -> None:
    """Write a metric: one number per run that requirements can bound."""
    write_example("metric", name, path or usual_folder("metric"))


def usual_folder(kind: str) -> Path:
    """Return the folder of the files that name such a part, or the present one if there is none.

    Args:
        kind: ``channel``, ``sensor`` or ``metric``.
    """
    folder = Path("odd") if kind == "metric" else Path("odd") / "architectures"
    return folder if folder.is_dir() else Path()


def write_example(kind: str, name: str, folder: Path) -> Path:
    """Write the example of a kind and print the YAML that uses it.

    Args:
        kind: ``channel``, ``sensor`` or ``metric``.
        name: Name of the part; the class is named after it.
        folder: Where to; it is made if it does not exist.

    Returns:
        The file.

    Raises:
        UsageError: The name is no identifier, or the file exists.
    """
    # own module
    from adeye.errors import UsageError

    if not _NAME.fullmatch(name) or keyword.iskeyword(name):
        raise UsageError(
            f"{name!r} cannot name a {kind}",
            remedy="Use lower case letters, digits and underscores, beginning with a letter.",
        )
    example = EXAMPLES[kind]
    path = folder / f"{name}.py"
    words = {"name": name, "class_name": class_name(name), "file": f"./{path.name}"}
    folder.mkdir(parents=True, exist_ok=True)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(Template(example.source).substitute(words))
    except FileExistsError as error:
        raise UsageError(
            f"{path} exists and is not overwritten", remedy="Choose another name or --path."
        ) from error
    wrote(path)
    emit(f"# use it in {Template(example.where).substitute(words)}")
    emit("# (the path is relative to the YAML file)")
    emit(clean(Template(example.usage).substitute(words), lines=True))
    return path


def class_name(name: str) -> str:
    """Name the class of a part.

    >>> class_name("lane_keeper")
    'LaneKeeper'
    """
    return "".join(part.capitalize() for part in name.split("_")) or "Part"


add(new_app, new_channel, "adeye new channel follower --path odd/architectures", name="channel")
add(new_app, new_sensor, "adeye new sensor sonar --path odd/architectures", name="sensor")
add(new_app, new_metric, "adeye new metric top_speed --path odd", name="metric")


# --- The example files that ``adeye new`` writes; each works as it stands -------------------------

CHANNEL: Final = '''\
"""$class_name, a control channel: keeps its lane and its distance. Change it and run again."""

import math

from adeye import ports


class $class_name:
    """One object per run. It sees what `links` names, nothing else; if it raises, it is silent."""

    class Parameters(ports.Parameters):
        """May be set under `parameters:`, and swept."""

        time_gap: float = 1.8  # [s]

    def __init__(self, parameters: Parameters, context: ports.ScalarContext) -> None:
        self.time_gap = parameters.time_gap
        self.desired_speed = context.desired_speed  # [m/s]
        self.wheelbase = context.vehicle.wheelbase  # [m]

    def act(self, observation: ports.ScalarObservation) -> ports.ScalarCommand:
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
        return ports.ScalarCommand(max(-8.0, min(1.5, cruise, follow)), steering)
'''

SENSOR: Final = '''\
"""$class_name, a sensor: the objects within its range, without error. Change it and run again."""

from adeye import ports


class $class_name:
    """Samples a batch of runs at its rate; a sample is delivered after its latency."""

    class Parameters(ports.Parameters):
        """May be set under `parameters:`, and swept."""

        range: float = 80.0  # [m]

    def __init__(self, context: ports.SensorContext) -> None:
        self.scene = context.scene
        self.objects = len(context.scene.object_ids)
        self.ranges = [self.Parameters(**spec.parameters).range for spec in context.specs]
        first = ports.no_measurement(self.scene.runs, self.objects, with_estimate=False)
        self.delivery = ports.Delivery.of(context, first)

    def sense(self, scene: ports.Scene) -> ports.Measurement:
        """Return the newest delivered sample; noise comes from ports.normal or uniform only."""
        if self.delivery.is_due(scene.tick):
            sample = ports.no_measurement(self.scene.runs, self.objects, with_estimate=False)
            sample.stamp[:] = scene.time
            for run in range(self.scene.runs):
                self.sample(run, scene, sample)
            self.delivery.push(scene.tick, sample)
        return self.delivery.newest(scene.tick)

    def sample(self, run: int, scene: ports.Scene, sample: ports.Measurement) -> None:
        """List what one run's ego sees, the nearest first, in the vehicle frame."""
        x, y, heading = scene.ego[run, :3]
        sine, cosine = ports.sin_cos(heading)
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

from adeye import ports


class $class_name:
    """Highest speed of the ego in the run."""

    uid = "local:$name@1"  # raise the version when the definition changes
    column = "${name}_mps"  # what requirements and tables call it
    unit = "m/s"
    worse = "higher"
    source = "example"

    def compute(self, trace: ports.Trace) -> ports.MetricColumn:
        """Return one value per run, with the time of the worst case."""
        rows = np.arange(trace.time.size)
        is_row = rows < trace.length[:, np.newaxis]  # runs end at different rows
        speed = np.where(is_row, trace["ego"][:, :, ports.EGO_SPEED], -np.inf)
        worst = speed.argmax(axis=1)
        runs = range(trace.runs)
        return ports.MetricColumn(
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


# --- ``init``: a small project to start from, that runs as it is ----------------------------------

ARCHITECTURE: Final = "camera_radar"
CONCEPT: Final = "motorway_chauffeur"

FIRST_ODD: Final = """\
# A first ODD: two scenarios, two faults, one architecture; 12 test cases.
#   adeye plan odd/first.yaml     counts them
#   adeye run odd/first.yaml      executes and judges them
odd: first
title: First steps on the motorway
attributes:
  scenery: {road_type: [motorway], lanes: {min: 2, max: 4}}
  environment: {rain: {max: 7.5 mm/h}, friction: {min: 0.5}, illumination: [day]}
  dynamic_elements: {ego_speed: {max: 130 km/h}}
scenarios:
  - use: cut_in                 # adeye scenario show cut_in
    sweep:
      parameters:
        gap: [45 m, 60 m]
  - use: lead_braking
    sweep:
      parameters:
        deceleration: [4 m/s^2, 6 m/s^2]
# Every scenario runs without a fault and with each of these.
faults:
  - id: front_camera_out
    target: sensors.front_camera
    model: drop_out
    onset: {at: 2 s}
    duration: 3 s
  - {id: nominal_silent, target: channels.nominal, model: silent, onset: {when: time >= 3 s}}
architectures: [architectures/camera_radar.yaml]
concept: concepts/motorway_chauffeur.yaml
step: 0.05 s
seed: 7
"""

README: Final = """\
# First steps with adeye

    adeye plan odd/first.yaml                          how many test cases, and why
    adeye run odd/first.yaml --report report.html      execute and judge them
    adeye query worst-runs                             ask the results (also in SQL)
    adeye show RUN                                     one run, by the beginning of its digest
    adeye replay RUN --html replay.html                execute it again, to the same bits

`first.yaml` says what is tested; `architectures/` holds the sensors, channels and switch under
test; `concepts/` holds the hazards, safety goals and functional safety requirements that judge it.
Turn the camera by 20 degrees or remove the radar in `architectures/camera_radar.yaml` and run it
again: which requirement fails, and by what margin? Only what the edit touches is executed.

`adeye signals odd/first.yaml` lists what a requirement may name, `adeye scenario list` the
scenarios, and `adeye new channel NAME` writes a channel of your own.
"""

ProjectFolder = Annotated[Path, typer.Argument(metavar="[DIR]", help="Folder of the project.")]


def init(folder: ProjectFolder = Path()) -> None:
    """Write a small project: an ODD, an architecture and a safety concept, ready to run.

    Nothing is overwritten. The scenarios come from the catalogue that adeye ships.
    """
    for path in write_project(folder):
        wrote(path)
    prefix = "" if folder == Path() else f"cd {clean(folder)} && "
    emit(f"Next: {prefix}adeye run odd/first.yaml --report report.html")


def project_files() -> dict[str, str]:
    """Return the files of the project, relative path to content."""
    from adeye.spec.load import shipped

    catalogue = shipped("odd")
    architecture = (catalogue / "architectures" / f"{ARCHITECTURE}.yaml").read_text("utf-8")
    concept = (catalogue / "concepts" / f"{CONCEPT}.yaml").read_text("utf-8")
    return {
        "odd/README.md": README,
        "odd/first.yaml": FIRST_ODD,
        f"odd/architectures/{ARCHITECTURE}.yaml": architecture,
        # The shipped concept asks for as many exercised runs as the shipped ODD has.
        f"odd/concepts/{CONCEPT}.yaml": re.sub(r"(min_exercised: )\d+", r"\g<1>1", concept),
    }


def write_project(folder: Path) -> list[Path]:
    """Write the project, all of it or nothing.

    Args:
        folder: Where to; it is made if it does not exist.

    Returns:
        The files.

    Raises:
        UsageError: One of the files exists.
    """
    from adeye.errors import UsageError

    contents = {folder / name: text for name, text in project_files().items()}
    existing = [str(path) for path in contents if path.exists()]
    if existing:
        raise UsageError(
            f"already there and not overwritten: {', '.join(existing)}",
            remedy="Name another folder: adeye init DIR.",
        )
    for path, text in contents.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    return list(contents)
