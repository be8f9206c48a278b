"""``map …``: roads that somebody else has drawn, shown, imported, checked, drawn and written."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from adeye.cli import output as out
from adeye.cli.options import Json, add

if TYPE_CHECKING:
    from adeye.maps.losses import Loss
    from adeye.maps.opendrive import OpenDrive

map_app = typer.Typer(
    help="Read maps of others: show, import, check, draw and export them.", no_args_is_help=True
)

MapFile = Annotated[Path, typer.Argument(metavar="FILE", help="The map's file, such as town.xodr.")]


def show_map(file: MapFile, json: Json = False) -> None:
    """Show what a map holds, and what of it is not taken as it is written.

    Examples:
        adeye map show town.xodr
        adeye map show town.xodr --json
    """
    from adeye.maps.opendrive_reader import read_opendrive

    drive, losses = read_opendrive(file)
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


def _print_losses(losses: list[Loss]) -> None:
    if not losses:
        out.emit("\nEverything is taken as it is written.")
        return
    rows = [[loss.kind, loss.element, loss.count, loss.line, loss.message] for loss in losses]
    out.emit_table(
        ("Kind", "Element", "Count", "First line", "What"),
        rows,
        title="Not taken as it is written",
        right=("Count", "First line"),
    )


add(map_app, show_map, name="show")
