"""``map …``: roads that somebody else has drawn, shown, imported, checked, drawn and written."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from adeye.cli import output as out
from adeye.cli.options import Json, add, named_place, option

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.maps.losses import Loss
    from adeye.maps.opendrive import OpenDrive

map_app = typer.Typer(
    help="Read maps of others: show, import, check, draw and export them.", no_args_is_help=True
)

MapFile = Annotated[Path, typer.Argument(metavar="FILE", help="The map's file, such as town.xodr.")]


Strict = Annotated[
    bool, option(help="Refuse a map of which anything is not taken as it is written.")
]


def show_map(file: MapFile, strict: Strict = False, json: Json = False) -> None:
    """Show what a map holds, and what of it is not taken as it is written.

    Lanes are counted once in each section, without the centres.

    Examples:
        adeye map show town.xodr
        adeye map show town.xodr --json
    """
    from adeye.maps.opendrive_reader import read_opendrive

    drive, losses = read_opendrive(file, strict=strict)
    document = {**_content(drive), "losses": list(losses)}
    if json:
        out.emit_json("map-show", document)
        return
    out.emit_fields(
        {
            "Map": drive.name or file.name,
            "Format": f"OpenDRIVE {drive.version[0]}.{drive.version[1]}",
            "Placed by": drive.geo_reference,
            "Roads": f"{document['roads']:,}, {document['length_m'] / 1000.0:,.3f} km",
            "Junctions": f"{document['junctions']:,}",
            "Lanes": f"{document['lanes']:,}, {document['driving_lanes']:,} to drive on",
            "Signals": f"{document['signals']:,}",
            "Geometry": out.listed(f"{n:,} {kind}" for kind, n in document["geometry"].items()),
        }
    )
    _print_losses(list(losses))


def import_map(
    file: MapFile,
    output: Annotated[Path | None, option("--output -o DIR", callback=named_place)] = None,
    *,
    strict: Strict = False,
    json: Json = False,
) -> None:
    """Check a map, and write what was not taken of it as NAME.losses.json.

    Parameters:
        output: Folder to write to; default: where the map is.

    Examples:
        adeye map import town.xodr
        adeye map import town.xodr -o maps --strict
    """
    from adeye.maps.opendrive_reader import read_opendrive
    from adeye.outputs import guarded, write_atomically

    report = (file.parent if output is None else output) / f"{file.stem}.losses.json"
    with guarded({"--output": report}):
        drive, losses = read_opendrive(file, strict=strict)
        document = {**_content(drive), "losses": list(losses)}
        write_atomically(out.json_text("map-losses", document).encode(), report)
    if json:
        out.emit_json("map-import", {**document, "written": [report]})
    else:
        _print_losses(list(losses))
        out.wrote(report)


def _content(drive: OpenDrive) -> dict[str, Any]:
    lanes = [
        lane
        for road in drive.roads.values()
        for section in road.sections
        for lane in section.lanes
        if lane.id
    ]
    return {
        "file": drive.path,
        "name": drive.name,
        "version": f"{drive.version[0]}.{drive.version[1]}",
        "geo_reference": drive.geo_reference,
        "roads": len(drive.roads),
        "length_m": sum(road.length for road in drive.roads.values()),
        "junctions": len(drive.junctions),
        "lanes": len(lanes),
        "driving_lanes": sum(lane.type == "driving" for lane in lanes),
        "signals": sum(len(road.signals) for road in drive.roads.values()),
        "geometry": Counter(
            piece.kind for road in drive.roads.values() for piece in road.geometries
        ),
    }


def _print_losses(losses: Sequence[Loss]) -> None:
    if not losses:
        out.emit("\nEverything is taken as it is written.")
        return
    # Of one kind of thing, the first is shown: the document has them all.
    groups: dict[tuple[str, str], list[Loss]] = {}
    for loss in losses:
        groups.setdefault((loss.kind, loss.element), []).append(loss)
    rows = [
        [kind, element, sum(loss.count for loss in group), group[0].line, group[0].message]
        for (kind, element), group in groups.items()
    ]
    out.emit_table(
        ("Kind", "Element", "Count", "First line", "What"),
        rows,
        title="Not taken as it is written",
        right=("Count", "First line"),
    )


add(map_app, show_map, name="show")
add(map_app, import_map, name="import")
