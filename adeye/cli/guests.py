"""``fmu …`` and ``channel …``: models and channels of others, and our parts for others."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from adeye.cli import output as out
from adeye.cli.options import Json, add, named, option, pairs_of, write_rows
from adeye.cli.progress import waiting
from adeye.errors import UsageError, require_known
from adeye.judge.verdict import ExitCode

if TYPE_CHECKING:
    from adeye.selftest.conformance import Conformance
    from adeye.simulate.bridges.fmi import Variable

# --- ``fmu …``: models of others by themselves, shown and stepped; our own parts for others -------

fmu_app = typer.Typer(
    help="Look at FMUs, step them by themselves, export parts.", no_args_is_help=True
)

FmuFile = Annotated[Path, typer.Argument(metavar="FILE", help="The FMU's file, such as brake.fmu.")]


class Part(str, Enum):  # noqa: UP042 - typer before 0.13 shows the name of a StrEnum
    """What of an architecture is exported."""

    plant = "plant"
    sensor = "sensor"
    channel = "channel"
    arbiter = "arbiter"


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
    values = {name: _value(text) for name, text in pairs_of("--start", start).items()}
    header, rows = simulate(file, stop, step, table, values)
    if output is None:
        out.emit_document(out.csv_text(header, rows).rstrip())
        return
    write_rows(header, rows, output)
    out.wrote(output)


def export_fmu(  # noqa: PLR0917 - options of the command line
    part: Annotated[Part, typer.Argument(metavar="PART")],
    architecture: Annotated[Path, typer.Argument(metavar="ARCHITECTURE")],
    name: Annotated[str | None, typer.Argument(metavar="[ID]")] = None,
    scenario: Annotated[Path | None, option("--scenario FILE")] = None,
    value: Annotated[list[str] | None, option("--set NAME=VALUE")] = None,
    step: Annotated[str, option("--step TIME", env="EXPORT_STEP")] = "0.05 s",
    seed: Annotated[int, option("--seed N")] = 0,
    output: Annotated[Path | None, option("--output -o FMU", callback=named)] = None,
) -> None:
    """Export a part of an architecture as an FMU of FMI 3.0, to be used in other tools.

    PART is plant (the vehicle), sensor or channel with its ID, or arbiter (the switch). Sensors and
    channels know a scenario: its road, how fast the ego is to drive, what there is to be seen. The
    tool that imports the FMU needs a Python with this version of adeye. Needs adeye[fmi].

    Parameters:
        part: What to export.
        architecture: The architecture's file.
        name: ID of the sensor or channel.
        scenario: Scenario that a sensor or channel knows.
        value: Value of a parameter of the scenario, such as gap='20 m'; may be repeated. Default:
            its own.
        step: Of the FMU, such as '0.05 s'; that of the ODD makes it what it is inside.
        seed: Of what sensors draw.
        output: File to write; default: the part's ID, or its kind, with .fmu.

    Examples:
        adeye fmu export arbiter odd/architectures/camera_radar.yaml
        adeye fmu export channel odd/architectures/camera_radar.yaml safety --scenario cut_in.yaml
    """
    from adeye.simulate.fmu_export import OF_SCENARIO, Export, write_fmu
    from adeye.spec.load import load_architecture, load_scenario
    from adeye.spec.odd import value_of_key
    from adeye.sweep.axes import default_values, parameter_value

    knows = part.value in OF_SCENARIO
    if (name is not None, scenario is not None) != (knows, knows) or (value and not knows):
        raise UsageError(
            f"{part.value} {'needs an' if knows else 'has no'} ID and --scenario",
            remedy="A sensor or channel has them, plant and arbiter do not.",
        )
    seed = value_of_key("seed", seed)
    found = Export(part.value, load_architecture(architecture).spec, value_of_key("step", step))
    if name is not None and scenario is not None:
        record = load_scenario(scenario).spec
        values = default_values(record)
        for key, text in pairs_of("--set", value).items():
            require_known([key], record.parameters, lambda key: f"--set: no parameter {key!r}")
            values[key] = parameter_value(record.parameters[key], text)
        found = replace(found, name=name, scenario=record, parameters=values, seed=seed)
    path = output or Path(f"{name or part.value}.fmu")
    write_fmu(found, path)
    out.wrote(path)


def _value(text: str) -> Any:
    if text in {"true", "false"}:
        return text == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


add(fmu_app, show_fmu, name="show")
add(fmu_app, simulate_fmu, name="simulate")
add(fmu_app, export_fmu, name="export")


# --- ``channel check``: does a channel of others keep to what is asked of one ---------------------

channel_app = typer.Typer(help="Check channels from outside by themselves.", no_args_is_help=True)

_MARKS = {True: "\N{CHECK MARK}", False: "\N{MULTIPLICATION X}", None: "\N{EN DASH}"}


def check_channel(
    what: Annotated[list[str], typer.Argument(metavar="ARCHITECTURE|COMMAND...")],
    *,
    channel: Annotated[str | None, option("ID", env="CHECK_CHANNEL")] = None,
    json: Json = False,
) -> None:
    """Check a channel from outside, in any language: a dozen cases, each with what is wrong.

    An architecture serves every kind: programs, what is at an address, FMUs, nodes of ROS, DDS and
    zenoh, policies and plug-ins. A command is checked in the place of the nominal channel of the
    shipped candidate; files in it begin with ./ as in an architecture.

    Exit codes: 0 it conforms, 1 a case did not pass, 2 input error, 5 no connection.

    Parameters:
        what: File of an architecture; or a program with its arguments, behind -- where these begin
            with a dash.
        channel: Which channel of the architecture; default: the only one from outside.

    Examples:
        adeye channel check odd/architectures/camera_radar.yaml --channel nominal
        adeye channel check perl ./cruise.pl
    """
    from adeye.selftest.conformance import check, subject_of, subject_of_command

    is_file = len(what) == 1 and what[0].endswith((".yaml", ".yml"))
    if not is_file and (channel is not None or what[0].endswith(".fmu")):
        raise UsageError(
            f"{what[0]} is no architecture",
            remedy="Name the architecture's file: it says what the channel is told, and how.",
        )
    subject = subject_of(Path(what[0]), channel) if is_file else subject_of_command(what)
    with waiting("a dozen cases"):
        found = check(subject)
    out.emit_found("channel-check", found, _print_conformance, json=json, document=_document)
    if not found.conforms:
        raise typer.Exit(ExitCode.FAILED)


def _document(found: Conformance) -> dict[str, Any]:
    return {**out.plain(found), "conforms": found.conforms}


def _print_conformance(found: Conformance) -> None:
    out.emit_line(f"{found.channel}, kind {found.kind}")
    for case in found.cases:
        out.emit_line(f" {_MARKS[case.passed]} {case.id:<13} {case.text}")
        if case.reason:
            out.emit_line(f"   {'':13} {case.reason}")
    count = [sum(case.passed is word for case in found.cases) for word in (True, False, None)]
    out.emit_line("{} passed, {} failed, {} not tried.".format(*count))


add(channel_app, check_channel, name="check")
