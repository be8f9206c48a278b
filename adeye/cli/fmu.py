"""``fmu …``: models of others by themselves, shown and stepped."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from adeye.cli import output as out
from adeye.cli.options import Json, add, named, option, write_rows
from adeye.errors import UsageError

if TYPE_CHECKING:
    from adeye.simulate.bridges.fmi import Variable

fmu_app = typer.Typer(help="Look at FMUs and step them by themselves.", no_args_is_help=True)

FmuFile = Annotated[Path, typer.Argument(metavar="FILE", help="The FMU's file, such as brake.fmu.")]


def show_fmu(file: FmuFile, json: Json = False) -> None:
    """Show what an FMU says of itself: its version of FMI, and variables with their units.

    Examples:
        adeye fmu show brake.fmu
        adeye fmu show brake.fmu --json
    """
    from adeye.outputs import reads
    from adeye.simulate.bridges.fmi import read_description

    reads(file)
    found = read_description(file)
    if json:
        variables = [_shown(item) for item in found.variables.values()]
        document = {
            "file": str(file),
            "model": found.model,
            "fmi_version": found.version,
            "tool": found.tool,
            "co_simulation": found.is_steppable,
            "state_can_be_kept": found.has_state,
            "variables": variables,
        }
        out.emit_json("fmu-show", document)
        return
    out.emit_fields(
        {
            "Model": found.model,
            "FMI": found.version,
            "Tool": found.tool or None,
            "Co-simulation": "yes" if found.is_steppable else "no",
            "State": "can be kept" if found.has_state else "cannot be kept",
        }
    )
    named_ones = [item for item in found.variables.values() if item.causality != "local"]
    out.emit_table(
        ("Variable", "Causality", "Type", "Unit", "Start"),
        [
            (item.name, item.causality, item.kind, item.unit or "-", item.start or "-")
            for item in named_ones
        ],
    )
    hidden = len(found.variables) - len(named_ones)
    if hidden:
        out.emit(f"and {hidden:,} local, see --json")


def _shown(item: Variable) -> dict[str, Any]:
    return {
        "name": item.name,
        "causality": item.causality,
        "variability": item.variability,
        "type": item.kind,
        "unit": item.unit or None,
        "start": item.start or None,
    }


def simulate_fmu(
    file: FmuFile,
    stop: Annotated[float, option("--stop T")],
    step: Annotated[float, option("--step H")],
    inputs: Annotated[Path | None, option("--inputs CSV")] = None,
    output: Annotated[Path | None, option("--output -o CSV", callback=named)] = None,
    start: Annotated[list[str] | None, option("--start NAME=VALUE")] = None,
) -> None:
    """Step an FMU by itself, in a process of its own, and write its outputs over time.

    Continuous inputs are interpolated between the rows of the table, others are held. The columns
    are time and the outputs, by name, in the FMU's own units.

    Parameters:
        stop: When to end [s].
        step: Length of a step [s].
        inputs: Table with a column time [s], then one for each input, by name.
        output: File to write; default: standard output.
        start: Start value of a variable; may be repeated.

    Examples:
        adeye fmu simulate brake.fmu --stop 10 --step 0.01
        adeye fmu simulate brake.fmu --stop 10 --step 0.01 --inputs pedal.csv -o brake.csv
    """
    from adeye.outputs import reads
    from adeye.simulate.bridges.master import read_table, simulate

    reads(file)
    table = None if inputs is None else read_table(inputs)
    values = dict(_assignment(item) for item in start or ())
    header, rows = simulate(file, stop, step, table, values)
    if output is None:
        out.emit_document(out.csv_text(header, rows).rstrip())
        return
    write_rows(header, rows, output)
    out.wrote(output)


def _assignment(text: str) -> tuple[str, Any]:
    name, sign, value = text.partition("=")
    if not sign or not name:
        raise UsageError(f"--start {text} is not NAME=VALUE", remedy="As in --start gain=0.5.")
    if value in {"true", "false"}:
        return name, value == "true"
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, value


add(fmu_app, show_fmu, name="show")
add(fmu_app, simulate_fmu, name="simulate")
