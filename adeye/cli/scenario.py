"""``scenario list|show|lint``: the catalogue and whether its files hold together."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from adeye.cli import output as out
from adeye.cli.options import Catalogue, Json, add, complete_scenarios
from adeye.errors import InputError, InputErrors, SpecError, UsageError, amount, require_known
from adeye.judge.verdict import ExitCode

if TYPE_CHECKING:
    from adeye.spec.load import Loaded
    from adeye.spec.scenario import Event, LogicalScenario, Parameter

scenario_app = typer.Typer(
    help="List, show and check the scenarios of the catalogue.", no_args_is_help=True
)


_SHOWN_TEXT: Final = 60


def list_scenarios(catalogue: Catalogue = None, json: Json = False) -> None:
    """List the scenarios of the catalogue with their parameters and ranges.

    Examples:
        adeye scenario list
        adeye scenario list --json
    """
    from adeye.spec.load import catalogue_files, load_scenario

    loaded = {name: load_scenario(path) for name, path in catalogue_files(catalogue).items()}
    if json:
        out.emit_json("scenario-list", {"scenarios": [_entry(*item) for item in loaded.items()]})
        return
    rows = [
        [
            name,
            item.spec.title,
            out.listed(_labels(item.spec)),
            out.listed(
                (f"{key} {_range(parameter)}" for key, parameter in item.spec.parameters.items()),
                most=_SHOWN_TEXT,
            ),
        ]
        for name, item in loaded.items()
    ]
    out.emit_table(("Id", "Title", "Tags", "Parameters"), rows)
    out.emit("\nAll parameters of one:  adeye scenario show ID")


def show_scenario(
    name: Annotated[str, typer.Argument(metavar="ID", autocompletion=complete_scenarios)],
    catalogue: Catalogue = None,
    json: Json = False,
) -> None:
    """Show one scenario: parameters with ranges, actors, storyboard, origin, places of its maps.

    At a place that is refused the scenario cannot start with its default values.

    Parameters:
        name: Id of the scenario.

    Examples:
        adeye scenario show cut_in
    """
    from adeye.spec.load import catalogue_files, catalogue_folder, load_scenario

    known = catalogue_files(catalogue)
    where = catalogue_folder(catalogue)
    require_known([name], sorted(known), lambda name: f"there is no scenario {name!r} in {where}")
    loaded = load_scenario(known[name])
    if json:
        found = _places(loaded) if loaded.spec.world.map else {}
        entry = {**_entry(name, loaded), "content": loaded.content, **found}
        out.emit_json("scenario-show", entry)
    else:
        _print(name, loaded)


def lint(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...")], json: Json = False
) -> None:
    """Check scenario files: syntax, units, names, lanes, the dimensions of every formula.

    An event that is neither under realised nor optional is a finding, as is a parameter that
    nothing depends on.

    Each finding has file, line and column. Exit codes: 0 nothing found, 2 something found.

    Parameters:
        files: Scenario files, or folders of them.

    Examples:
        adeye scenario lint scenarios_db
        adeye scenario lint my_cut_in.yaml
    """
    paths = [path for given in files for path in _scenarios_of(given)]
    findings: list[InputError] = []
    for path in paths:
        for error in _findings(path):
            findings += error.errors if isinstance(error, InputErrors) else [error]
    if json:
        out.emit_json(
            "scenario-lint", {"files": paths, "findings": [_finding(e) for e in findings]}
        )
    else:
        for error in findings:
            out.emit(out.clean(error, lines=True))
    out.talk(f"{amount(len(paths), 'file')}, {amount(len(findings), 'finding')}")
    if findings:
        raise typer.Exit(ExitCode.USAGE)


def _scenarios_of(path: Path) -> Iterable[Path]:

    if not path.is_dir():
        return [path]
    found = sorted(path.rglob("*.yaml"))
    if not found:
        raise UsageError(f"{path} holds no .yaml file", remedy="Name files or their folder.")
    return found


def _findings(path: Path) -> Iterator[InputError]:
    from adeye.campaign.check import check_defaults, refused_starts
    from adeye.simulate.world.check import check_purpose, check_scenario
    from adeye.spec.load import at_place, load_scenario
    from adeye.spec.places import Offer

    try:
        loaded = load_scenario(path)
    except InputError as error:
        yield error
        return
    if loaded.spec.world.map:
        starts = refused_starts(loaded, Offer(loaded.spec, loaded.locate))
        place = next((place for place, refusal in starts if not refusal), None)
        loaded = at_place(loaded, place) if place else loaded
    spec = loaded.spec
    for loc, message in check_scenario(spec) or [*check_defaults(spec), *check_purpose(spec)]:
        yield SpecError(message, where=loaded.locate(loc))


def _finding(error: InputError) -> dict[str, Any]:
    return {
        "where": error.where,
        "kind": type(error).__name__,
        **out.fields_of(error, "message", "remedy"),
    }


def _entry(name: str, loaded: Loaded[LogicalScenario]) -> dict[str, Any]:
    spec = loaded.spec
    return {
        "id": name,
        "title": spec.title,
        "text": spec.text,
        "path": loaded.path,
        "tags": spec.tags.model_dump(),
        "parameters": {
            key: {"default": item.default, "range": item.range, "text": item.text}
            for key, item in spec.parameters.items()
        },
    }


def _labels(spec: LogicalScenario) -> Iterator[str]:
    """Give the tags of a scenario: those of catalogues are known by their text."""
    own = spec.tags.own
    yield from (text for name, text in spec.tags.by_name.items() if name not in own)
    yield from (f"{name}: {text}" for name, text in own.items())


def _range(parameter: Parameter) -> str:
    if parameter.range is None:
        return f"= {out.format_value(parameter.default)}"
    low, high = parameter.range
    return f"{out.format_value(low)} to {out.format_value(high)}"


def _action(event: Event) -> str:
    names = ("lane_change", "speed", "stop", "cross")
    return next(name for name in names if getattr(event, name) is not None)


def _places(loaded: Loaded[LogicalScenario]) -> dict[str, Any]:
    """List the places of a scenario's maps, and count by reason what was looked at beside."""
    from adeye.campaign.check import refused_starts
    from adeye.spec.places import Offer

    offer = Offer(loaded.spec, loaded.locate)
    places = [
        {
            "key": key,
            "road_type": key.place.road_type,
            "lanes": key.place.lanes,
            "speed_limit_mps": key.place.speed_limit,
            "is_limit_guessed": key.place.is_guessed,
            "is_type_guessed": key.place.is_type_guessed,
            "radius_m": key.place.radius if key.place.radius < math.inf else None,
            "refused": refusal or None,
        }
        for key, refusal in refused_starts(loaded, offer)
    ]
    return {"places": places, "lacking": offer.lacking}


def _print_places(loaded: Loaded[LogicalScenario]) -> None:
    found = _places(loaded)
    places, refused = found["places"], sum(item["refused"] is not None for item in found["places"])
    beside = [f"{count:,} {reason}" for reason, count in sorted(found["lacking"].items())]
    out.emit_line(f"Places: {len(places) - refused:,} of {len(places):,}, {refused:,} refused")
    if beside:
        out.emit_line(f"Beside them: {out.listed(beside)}")
    rows: list[Sequence[object]] = [
        [
            item["key"],
            f"{item['road_type']}{' (guessed)' * item['is_type_guessed']}",
            item["lanes"],
            f"{item['speed_limit_mps'] * 3.6:.0f} km/h{' (guessed)' * item['is_limit_guessed']}",
            "" if item["radius_m"] is None else f"{item['radius_m']:.0f} m",
            item["refused"] or "",
        ]
        for item in places
    ]
    out.emit_table(("Place", "Road", "Lanes", "Limit", "Narrowest bend", "Refused"), rows)


def _print(name: str, loaded: Loaded[LogicalScenario]) -> None:
    spec = loaded.spec
    out.emit_fields(
        {
            "Scenario": name,
            "Title": spec.title,
            "Text": " ".join(spec.text.split()),
            "File": loaded.path,
            "Source": " ".join(spec.provenance.source.split()),
            **{f"Tag {key}": tag for key, tag in spec.tags.model_dump().items()},
            "Horizon": f"{spec.horizon:g} s, then {spec.tail:g} s tail",
            "Realised when": out.listed(spec.realised),
        }
    )
    rows: list[Sequence[object]] = [
        [key, item.default, _range(item), item.text] for key, item in spec.parameters.items()
    ]
    out.emit_table(("Parameter", "Default", "Range", "Meaning"), rows, title="Parameters")
    rows = [
        [key, item.kind, "reactive" if item.reactive else "scripted"]
        for key, item in spec.actors.items()
    ]
    out.emit_table(("Actor", "Kind", "Driven"), rows, title="Actors")
    rows = [
        [key, event.actor, event.when.text, _action(event)]
        for key, event in spec.storyboard.items()
    ]
    out.emit_table(("Event", "Actor", "When", "Action"), rows, title="Storyboard")
    if spec.world.map:
        _print_places(loaded)


add(scenario_app, list_scenarios, name="list")
add(scenario_app, show_scenario, name="show")
add(scenario_app, lint)
