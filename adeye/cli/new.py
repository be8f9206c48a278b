"""``new channel|sensor|metric``: write a working example to start from."""

from __future__ import annotations

import keyword
import re
from pathlib import Path
from string import Template
from typing import Annotated, Final

import typer

from adeye.cli.options import add
from adeye.cli.output import clean, emit, wrote

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
    from adeye.cli.examples import EXAMPLES
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
