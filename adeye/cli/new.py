"""``new channel|sensor|metric`` and ``init``: write a working example to start from."""

from __future__ import annotations

import json
import keyword
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from string import Template
from typing import Annotated, Final

import typer

from adeye.cli.options import add, option
from adeye.cli.output import clean, emit, emit_table, wrote
from adeye.errors import InputError, UsageError, require_known
from adeye.units import shown

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
    option("DIR", help="Folder that it is put into, by default that of the files that name it."),
]


def new_channel(name: PartName, path: Folder = None) -> None:
    """Write a control channel: one Python object per run that answers what it observes.

    Examples:
        adeye new channel follower --path odd/architectures
    """
    write_example("channel", name, path or usual_folder("channel"))


def new_sensor(name: PartName, path: Folder = None) -> None:
    """Write a sensor: ground truth in, measurements out, at a rate and a latency.

    Examples:
        adeye new sensor sonar --path odd/architectures
    """
    write_example("sensor", name, path or usual_folder("sensor"))


def new_metric(name: PartName, path: Folder = None) -> None:
    """Write a metric: one number per run that requirements can bound.

    Examples:
        adeye new metric top_speed --path odd
    """
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


add(new_app, new_channel, name="channel")
add(new_app, new_sensor, name="sensor")
add(new_app, new_metric, name="metric")


# --- The examples that ``adeye new`` writes; each works as it stands ------------------------------


@dataclass(frozen=True, slots=True)
class Example:
    """A kind of part with its example.

    Attributes:
        kind: ``channel``, ``sensor`` or ``metric``.
        where: Which file the YAML belongs to.
    """

    kind: str
    where: str

    @property
    def source(self) -> str:
        """Text of the file, with ``$name`` and ``$class_name``."""
        return _template(f"{self.kind}.py.txt")

    @property
    def usage(self) -> str:
        """YAML that uses it, with ``$name``, ``$class_name`` and ``$file``."""
        return _template(f"{self.kind}.yaml.txt").removesuffix("\n")


@cache
def _template(name: str) -> str:
    from adeye.packaged import packaged_text

    return packaged_text("adeye.cli", f"templates/{name}")


EXAMPLES: Final = {
    example.kind: example
    for example in (
        Example("channel", "an architecture; name it in the switch as well"),
        Example("sensor", "an architecture; link a channel to it"),
        Example("metric", "an ODD; a requirement bounds it as {metric: ${name}_mps, at_most: 40}"),
    )
}
"""Examples by kind of part."""


# --- ``init``: a small project to start from, that runs as it is ----------------------------------

FIRST: Final = "first"
ARCHITECTURE: Final = "camera_radar"
CONCEPT: Final = "motorway_chauffeur"


class Service(str, Enum):  # noqa: UP042 - typer before 0.13 shows the name of a StrEnum
    """Where a workflow runs."""

    github = "github"
    gitlab = "gitlab"


WORKFLOWS: Final = {
    Service.github: Path(".github", "workflows", "adeye.yml"),
    Service.gitlab: Path(".gitlab-ci.yml"),
}
"""Where each service looks for its workflows."""
_ITEM: Final = {Service.github: 10 * " ", Service.gitlab: 6 * " "}
"""What is before an item of its list of ODDs."""


def init(
    folder: Annotated[Path, typer.Argument(metavar="[DIR]")] = Path(),
    *,
    example: Annotated[str | None, option("NAME", env="INIT_EXAMPLE")] = None,
    ci: Annotated[Service | None, option("SERVICE", env="INIT_CI")] = None,
    list_examples: Annotated[bool, option("--list -l", env="INIT_LIST")] = False,
) -> None:
    """Write a small project: an ODD, an architecture and a safety concept, ready to run.

    Nothing is overwritten. The scenarios come from the catalogue that adeye ships.

    Parameters:
        folder: Folder of the project.
        example: Write this shipped ODD instead, with the architectures and the concept that it
            names, to start from or to change.
        ci: Write the workflow that executes and judges each ODD that the project has by now; one
            is written if there is none.
        list_examples: List the shipped ODDs.

    Examples:
        adeye init
        adeye init my_project
        adeye init ramps --example ramp
        adeye init --ci github
    """
    if list_examples:
        emit_table(("Example", "About"), list(shipped_odds().items()))
        return
    there = odds_in(folder) if ci is not None and example is None else ()
    name = example or FIRST
    contents: dict[str, bytes] = {}
    if not there:
        contents |= project_files() if example is None else example_files(example)
    if ci is not None:
        contents[WORKFLOWS[ci].as_posix()] = workflow(ci, there or (f"odd/{name}.yaml",))
    for path in write_files(folder, contents):
        wrote(path)
    if not there:
        prefix = "" if folder == Path() else f"cd {clean(folder)} && "
        emit(f"Next: {prefix}adeye run odd/{name}.yaml --report report.html")


def shipped_odds() -> dict[str, str]:
    """Return the titles of the shipped ODDs by name."""
    from adeye.spec.load import load_odd, shipped

    return {
        path.stem: load_odd(path).odd.spec.title for path in sorted(shipped("odd").glob("*.yaml"))
    }


def example_files(name: str) -> dict[str, bytes]:
    """Return a shipped ODD with all files of its folder that it is read from.

    Raises:
        UsageError: None has this name.
    """
    from adeye.spec.load import load_odd, shipped

    catalogue = shipped("odd")
    known = sorted(path.stem for path in catalogue.glob("*.yaml"))
    require_known((name,), known, lambda name: f"there is no example {name!r}")
    read = load_odd(catalogue / f"{name}.yaml").inputs()
    return {
        place: (catalogue.parent / place).read_bytes() for place in read if place.startswith("odd/")
    }


def odds_in(folder: Path) -> tuple[str, ...]:
    """Give the files of a project's ODDs, as paths from its root: all that say which ODD they are.

    One that cannot be read may be one if it looks like it.
    """
    found = sorted(path for end in ("yaml", "yml") for path in (folder / "odd").rglob(f"*.{end}"))
    return tuple(path.relative_to(folder).as_posix() for path in found if _may_be_odd(path))


def _may_be_odd(path: Path) -> bool:
    from adeye.spec.load import says_odd

    try:
        return says_odd(path)
    except InputError:
        return re.search(rb"\bodd\b|^extends\b", path.read_bytes(), re.MULTILINE) is not None


def workflow(service: Service, odds: Sequence[str]) -> bytes:
    """Return the workflow that executes and judges ODDs, given the paths of their files.

    Raises:
        UsageError: A path cannot stand in a workflow.
    """
    for path in odds:
        if re.fullmatch(r"[\w ./+-]+", path, re.ASCII) is None:
            raise UsageError(
                f"{shown(path)} cannot stand in a workflow",
                remedy="Call the file by letters, digits, spaces and _ . + - alone.",
            )
    text = Template(_template(f"ci/{service.value}.yml.txt"))
    lines = [json.dumps({"ODD": name, "FILE": path}) for name, path in unique_names(odds).items()]
    return text.substitute(odds="\n".join(f"{_ITEM[service]}- {line}" for line in lines)).encode()


def unique_names(odds: Sequence[str]) -> dict[str, str]:
    """Name ODDs for caches and artefacts, after their files: a name a path.

    >>> unique_names(["odd/a.yaml", "odd/sub/a.yml", "odd/a.yml"])
    {'a': 'odd/a.yaml', 'sub-a': 'odd/sub/a.yml', 'a-2': 'odd/a.yml'}
    """
    names: dict[str, str] = {}
    for path in odds:
        stem = "-".join(re.split(r"[/ ]", path.removeprefix("odd/").rpartition(".")[0]))
        taken = sum(name == stem or name.startswith(f"{stem}-") for name in names)
        names[stem if stem not in names else f"{stem}-{taken + 1}"] = path
    return names


def project_files() -> dict[str, bytes]:
    """Return the files of the project, relative path to content."""
    from adeye.spec.load import shipped

    catalogue = shipped("odd")
    architecture = (catalogue / "architectures" / f"{ARCHITECTURE}.yaml").read_text("utf-8")
    concept = (catalogue / "concepts" / f"{CONCEPT}.yaml").read_text("utf-8")
    texts = {
        **{name: _template(name) for name in ("odd/README.md", f"odd/{FIRST}.yaml")},
        f"odd/architectures/{ARCHITECTURE}.yaml": architecture,
        # The shipped concept asks for as many exercised runs as the shipped ODD has.
        f"odd/concepts/{CONCEPT}.yaml": re.sub(r"(min_exercised: )\d+", r"\g<1>1", concept),
    }
    return {name: text.encode() for name, text in texts.items()}


def write_files(folder: Path, files: Mapping[str, bytes]) -> list[Path]:
    """Write files, all of them or none.

    Args:
        folder: Where to; it is made if it does not exist, as are those below it.
        files: Content by the path below it.

    Returns:
        The files.

    Raises:
        UsageError: One of the files exists.
    """
    contents = {folder / name: content for name, content in files.items()}
    existing = [str(path) for path in contents if path.exists()]
    if existing:
        raise UsageError(
            f"already there and not overwritten: {', '.join(existing)}",
            remedy="Name another folder: adeye init DIR.",
        )
    for path, content in contents.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("xb") as file:
            file.write(content)
    return list(contents)
