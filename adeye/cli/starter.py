"""``init``: a small project to start from, that runs as it is."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Final

import typer

from adeye.cli.output import clean, emit, wrote

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
