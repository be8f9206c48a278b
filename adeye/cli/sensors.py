"""``sensors``: what the suites of architectures see and how fast that lets the ego go."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from adeye.cli.options import Json
from adeye.cli.output import emit_json, wrote
from adeye.cli.suites import print_suites
from adeye.cli.writing import named_page

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.evaluation.suite.conditions import Condition
    from adeye.evaluation.suite.results import Suite
    from adeye.spec.architecture import Architecture
    from adeye.spec.load import Loaded, OddFiles

ArchitectureFiles = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="[ARCHITECTURE]...",
        help="Architecture files, such as odd/architectures/lidar.yaml; default: those of --odd.",
    ),
]
ForOdd = Annotated[
    Path | None,
    typer.Option(
        "--odd",
        metavar="ODD",
        envvar="ADEYE_ODD",
        help="Take conditions, highest speed and shared resources from an ODD, and its "
        "architectures if none are named.",
    ),
]
SuitesFile = Annotated[
    Path | None,
    typer.Option(
        "--html",
        metavar="FILE",
        envvar="ADEYE_HTML",
        callback=named_page,
        help="Write the tables and a drawing of each suite as one HTML page.",
    ),
]


def sensors(
    architectures: ArchitectureFiles = None,
    odd: ForOdd = None,
    json: Json = False,
    html: SuitesFile = None,
) -> None:
    """Analyse the sensor suites of architectures without simulation, side by side.

    Coverage of the zones around the ego, blind spots, range to spare over what braking needs, the
    highest speed that is left in rain and at night, the forward range that UN R157 asks for, and
    what remains when a sensor fails.
    """
    from adeye.errors import UsageError
    from adeye.evaluation.suite.analysis import analyse
    from adeye.evaluation.suite.conditions import DEFAULTS, conditions_of
    from adeye.spec.load import load_architecture, load_odd

    files = load_odd(odd) if odd is not None else None
    loaded = [load_architecture(path) for path in architectures or ()]
    if not loaded and files is not None:
        loaded = list(files.architectures.values())
    if not loaded:
        raise UsageError(
            "there is no architecture to analyse",
            remedy="Name architecture files, or an ODD with --odd.",
        )
    conditions: Sequence[Condition] = DEFAULTS
    if files is not None:
        conditions = conditions_of(files.odd.spec.attributes.environment)
    suites = [
        analyse(item.spec, conditions, odd_speed=_speed(files), resources=_resources(files))
        for item in _distinct(loaded)
    ]
    if json:
        emit_json("sensors", {"odd": files.odd.spec.odd if files else None, "suites": suites})
    else:
        print_suites(suites)
    if html is not None:
        _write(suites, files, html)


def _distinct(loaded: Sequence[Loaded[Architecture]]) -> Sequence[Loaded[Architecture]]:
    from adeye.errors import SpecError

    known: dict[str, Loaded[Architecture]] = {}
    for item in loaded:
        name = item.spec.architecture
        if name in known:
            raise SpecError(
                f"architecture {name!r} is in another file, too: {known[name].path}",
                where=item.locate(("architecture",)),
                remedy="Give each architecture an id of its own.",
            )
        known[name] = item
    return loaded


def _speed(files: OddFiles | None) -> float | None:
    limit = None if files is None else files.odd.spec.attributes.dynamic_elements.ego_speed
    return None if limit is None else limit.max


def _resources(files: OddFiles | None) -> Mapping[str, Sequence[str]]:
    if files is None:
        return {}
    return {element.id: element.resources for element in files.concept.spec.elements}


def _write(suites: Sequence[Suite], files: OddFiles | None, path: Path) -> None:
    from adeye.report.suite_page import write_suites

    write_suites(suites, path, title="" if files is None else files.odd.spec.title)
    wrote(path)
