"""``dependencies``: what the channels of an architecture share, and could fail by together."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli.options import Json, OddFile
from adeye.cli.output import clean, emit, emit_json, emit_table, listed

if TYPE_CHECKING:
    from adeye.evaluation.dependence import ChannelPair, Dependencies, Kind, Shared
    from adeye.spec.load import OddFiles

OfArchitecture = Annotated[
    str | None,
    typer.Option(
        "--architecture",
        metavar="ID",
        envvar="ADEYE_ARCHITECTURE",
        help="Only this architecture; default: all of the ODD.",
    ),
]
_ABSENT: Final[tuple[Kind, ...]] = (
    "sensor",
    "ego_estimate",
    "resource",
    "element",
    "code",
    "influence",
)
"""Kinds of which it is worth saying that there are none."""


def dependencies(odd: OddFile, architecture: OfArchitecture = None, json: Json = False) -> None:
    """List what could make two channels of the switch fail together. Nothing is executed.

    Common sensors and ego estimate, the map, resources such as power of the elements that they
    realise, code, links from one to the other, switch and vehicle; and what a fault entry has to
    hit, all of it at once, to see what becomes of its failure.
    """
    from adeye.errors import UsageError, suggest
    from adeye.spec.load import load_odd

    files = load_odd(odd)
    found = dependencies_of(files)
    if architecture is not None:
        if architecture not in files.architectures:
            raise UsageError(
                f"the ODD has no architecture {clean(architecture)!r}",
                remedy=suggest(architecture, files.architectures),
            )
        found = [item for item in found if item.architecture == architecture]
    if json:
        emit_json("dependencies", {"odd": files.odd.spec.odd, "architectures": found})
        return
    for item in found:
        _print(item)


def dependencies_of(files: OddFiles) -> list[Dependencies]:
    """List what channels share in each architecture of an ODD, as it is written."""
    from adeye.evaluation.dependence import dependencies as analyse

    elements = files.concept.spec.elements
    return [analyse(item.spec, elements) for item in files.architectures.values()]


def _print(found: Dependencies) -> None:
    if not found.pairs:
        emit(f"{found.architecture}: one channel, with nobody to share anything")
    for pair in found.pairs:
        title = f"{found.architecture}: {pair.first} and {pair.second} share {_in_words(pair)}"
        rows = [_row(item) for item in pair.shared]
        emit_table(("Kind", "What", "How", "Fault targets"), rows, title=title)
        if pair.unstated:
            emit(f"No resources are stated for {listed(pair.unstated)}: they may share more.")


def _in_words(pair: ChannelPair) -> str:
    from adeye.evaluation.dependence import WORDS

    absent = [WORDS[kind] for kind in _ABSENT if not pair.count(kind)]
    return f"{len(pair.shared)} things" + (f"; no {', no '.join(absent)}" if absent else "")


def _row(item: Shared) -> list[str]:
    from adeye.evaluation.dependence import WORDS

    model = f" ({item.model})" if item.model else ""
    return [WORDS[item.kind], item.what, item.how, f"{listed(item.targets)}{model}"]
