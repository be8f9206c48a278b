"""``map …``: roads that somebody else has drawn, shown, imported, checked, drawn and written."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from adeye.cli import output as out
from adeye.cli.options import Json, add, named, named_place, option, write_rows
from adeye.errors import UsageError
from adeye.judge.verdict import ExitCode

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.maps.losses import Loss
    from adeye.maps.opendrive import OpenDrive
    from adeye.maps.topology import Finding

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
    from adeye.spec.places import read_map

    drive, losses = read_map(file, strict=strict)
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
            "Signals": f"{document['signals']:,}"
            + (", drawn and exported; no run heeds them" if document["signals"] else ""),
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
    """Check a map and compile it: NAME.network.npz holds its lanes, NAME.losses.json what is lost.

    The same map gives the same files. What a map leaves to a guess may be given by a rules.yaml
    beside it. What is wrong between its lanes is told by map check.

    Parameters:
        output: Folder to write to; default: where the map is.

    Examples:
        adeye map import town.xodr
        adeye map import town.xodr -o maps --strict
    """
    from adeye.outputs import guarded, write_atomically
    from adeye.spec.places import read_map

    folder = file.parent if output is None else output
    network, report = (folder / f"{file.stem}.{end}" for end in ("network.npz", "losses.json"))
    with guarded({"--output": report, "--output of lanes": network}):
        drive, losses = read_map(file, strict=strict)
        from adeye.maps.compiling import archive, compiled_map

        written = archive(compiled_map(drive))
        document = {**_content(drive), "losses": list(losses)}
        write_atomically(out.json_text("map-losses", document).encode(), report)
        write_atomically(written, network)
    if json:
        out.emit_json("map-import", {**document, "written": [network, report]})
    else:
        _print_losses(list(losses))
    out.wrote(network)
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


# --- ``map check``: whether it holds together -----------------------------------------------------

_LISTED: Final = 20
"""Findings of one kind that are printed."""


def check_map(file: MapFile, json: Json = False) -> None:
    """Check whether the lanes of a map hold together.

    Gaps and kinks where lanes meet, lanes that end, overlap or lead into one that is not driven on,
    links against the direction of driving or of one side only, bends tighter than a car can drive,
    lanes without width or of a type that OpenDRIVE does not know, speed limits of 0, junctions
    without the connections that they need. Where a road ends with the map is a note.

    Exit codes: 0 no error, 1 an error among the findings, 2 a file that cannot be read.

    Examples:
        adeye map check town.xodr
        adeye map check town.xodr --json
    """
    from adeye.maps.topology import check_topology
    from adeye.spec.places import read_map

    findings = check_topology(read_map(file)[0])
    counts = Counter(finding.severity for finding in findings)
    totals = {f"{name}s": counts[name] for name in ("error", "warning", "note")}
    if json:
        out.emit_json("map-check", {"file": file, **totals, "findings": findings})
    else:
        _print_findings(file, findings)
    out.talk(", ".join(f"{count:,} {name}" for name, count in totals.items()))
    if totals["errors"]:
        raise typer.Exit(ExitCode.FAILED)


def _print_findings(file: Path, findings: list[Finding]) -> None:
    kinds = Counter(finding.kind for finding in findings)
    shown: Counter[str] = Counter()
    for item in findings:
        shown[item.kind] += 1
        if shown[item.kind] <= _LISTED:
            place = f"{file}:{item.line}: {item.severity}: {item.kind}"
            out.emit_line(f"{place}: {item.place}: {item.message}")
    for kind, count in kinds.items():
        if count > _LISTED:
            out.emit_line(f"{count - _LISTED:,} more of {kind}; --json lists all.")


# --- ``map draw`` ---------------------------------------------------------------------------------


def draw(
    file: MapFile,
    *,
    output: Annotated[Path, option("--output -o FILE", env="MAP_DRAWING", callback=named)],
) -> None:
    """Draw a map as SVG: lanes by kind, with ids, widths and directions, lights, junctions.

    Parameters:
        file: The map's file.
        output: Where to.

    Examples:
        adeye map draw town.xodr -o town.svg
    """
    from adeye.maps.drawing import draw_map
    from adeye.outputs import write_atomically
    from adeye.spec.places import read_map

    drive, _ = read_map(file)
    write_atomically(draw_map(drive, drive.name or file.name).encode(), output)
    out.wrote(output)


# --- ``map export``: its lanes as rows, and the map, or a scenario's road, as OpenDRIVE -----------

_SCENARIOS: Final = (".yaml", ".yml")


def export_map(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A map, or a scenario's file.")],
    *,
    lanes: Annotated[Path | None, option("FILE", env="MAP_LANES", callback=named)] = None,
    step: Annotated[float, option("METRES", env="MAP_STEP")] = 25.0,
    xodr: Annotated[Path | None, option("FILE", env="MAP_XODR", callback=named)] = None,
) -> None:
    """Write where the lanes of a map are, or the map as a file of OpenDRIVE.

    A scenario gives its parametric road, with the default values of its parameters.

    Parameters:
        file: A map, or the file of a scenario.
        lanes: Write the centre lines of all lanes as CSV: at every road's start, each step and its
            end. Where a section begins, its lanes are meant; headings are towards greater s.
        step: Along each road.
        xodr: Write the map as OpenDRIVE.

    Examples:
        adeye map export town.xodr --lanes lanes.csv --step 25
        adeye map export scenarios_db/motorway/cut_in.yaml --xodr cut_in.xodr
    """
    from adeye.maps.lanes import EXPORTED, lane_rows
    from adeye.maps.opendrive_writer import write_opendrive
    from adeye.outputs import write_atomically

    if lanes is None and xodr is None:
        raise UsageError("nothing to write is named", remedy="Name --lanes or --xodr, or both.")
    if not 0.01 <= step < math.inf:
        raise UsageError(f"--step {step:g} is too short", remedy="Give 0.01 metres or more.")
    drive, losses = _map_of(file)
    if lanes is not None:
        write_rows(EXPORTED, lane_rows(drive, step), lanes)
        out.wrote(lanes)
    if xodr is not None:
        write_atomically(write_opendrive(drive), xodr)
        for loss in losses:
            out.talk(f"{loss.kind}: {loss.element}: {loss.message}")
        out.wrote(xodr)


def _map_of(file: Path) -> tuple[OpenDrive, list[Loss]]:
    """Return a map, or the road of a scenario as one with what it cannot say."""
    if file.suffix.lower() not in _SCENARIOS:
        from adeye.maps.opendrive_writer import map_losses
        from adeye.spec.places import read_map

        drive = read_map(file)[0]
        return drive, list(map_losses(drive))
    import numpy as np

    from adeye.maps.mirror import mirrored
    from adeye.maps.opendrive_writer import losses_of, parametric_map
    from adeye.simulate.world.formulas import Formulas
    from adeye.simulate.world.roads import build_roads
    from adeye.spec.load import load_scenario
    from adeye.sweep.axes import default_values

    scenario = load_scenario(file).spec
    written = scenario.world.road
    if scenario.world.map is not None:
        raise UsageError(f"{file}: its roads are those of a map", remedy="Export the map itself.")
    columns = {name: np.array([value]) for name, value in default_values(scenario).items()}
    road = build_roads(Formulas(1, ((scenario, np.array([0]), columns),)))
    drive = parametric_map(
        road, markings=written.markings, road_type=written.road_type, path=file.name
    )
    return (mirrored(drive) if road.left_hand else drive), list(losses_of(road, written.markings))


add(map_app, show_map, name="show")
add(map_app, check_map, name="check")
add(map_app, draw)
add(map_app, export_map, name="export")
add(map_app, import_map, name="import")
