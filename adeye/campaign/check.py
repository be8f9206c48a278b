"""Check what a plan would simulate before anything runs: formulas, onsets, values, plug-ins."""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cache
from itertools import chain, islice
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel

from adeye.campaign.parts import Parts, check_driver_words, check_words, load_code, named_files
from adeye.errors import (
    ExpressionError,
    InputError,
    SpecError,
    SweepError,
    Together,
    placed,
    raise_all,
    suggest,
)
from adeye.identity import digest
from adeye.kernel.relation import tick_times
from adeye.simulate.channels.factory import make_channel
from adeye.simulate.faults.schedule import TIME_TOLERANCE
from adeye.simulate.world.check import (
    Finding,
    check_scenario,
    check_worlds,
    formulas_used,
    missing_lanes,
)
from adeye.simulate.world.clock import ticks
from adeye.simulate.world.storyboard import trigger_variables
from adeye.spec.architecture import HEALTH
from adeye.spec.concept import Concept, budgets_of
from adeye.spec.expression import Expression, may_hold, to_program
from adeye.spec.fault import Fault, Late
from adeye.spec.load import Loaded, OddFiles, at_place, load_architecture, shipped
from adeye.spec.places import PLACE, ROAD, Offer, PlaceRoad, place_of, require_posted
from adeye.spec.plausible import BOUNDS, Implausible, implausible
from adeye.spec.quantity import Record, require_dimension
from adeye.spec.sensor_faults import SensorFault
from adeye.sweep.axes import AxisReader, Kind, default_values
from adeye.sweep.case import content_digest, nameless_digest
from adeye.sweep.expand import Expansion, World
from adeye.sweep.groups import guilty_path
from adeye.units import Dimension, parse_quantity

if TYPE_CHECKING:
    from adeye.errors import SourceLocation
    from adeye.signals import Floats
    from adeye.spec.architecture import Architecture
    from adeye.spec.document import Loc
    from adeye.spec.odd import ScenarioUse
    from adeye.spec.scenario import LogicalScenario
    from adeye.sweep.case import Shared
    from adeye.sweep.groups import Group, Section

# --- Who wrote a value of a file that an ODD varies: the place in the ODD, if the ODD did ---------

Path = tuple[str, ...]


def author(
    files: OddFiles, group: Group, record: Record, path: Path, kind: Kind = "scenario"
) -> SourceLocation | None:
    """Find the axis or fixed value of an ODD behind a value of a scenario or another file.

    It is the one that wrote the value or a part above it; else one whose parameter the formula
    there uses; else one that wrote into the same section, because what is wrong may be wrong
    together. Of several the last in the ODD.

    Args:
        files: The ODD and everything it names.
        group: Whose points are looked at.
        record: With what the ODD writes into it.
        path: Dotted path of the value below the record, as the sweep writes it.
        kind: Of the record.

    Returns:
        None if the ODD has no part in it.
    """
    written = [*_written(files, group, kind)]
    formula = _at(record, path)
    names = formula.names if isinstance(formula, Expression) else frozenset()
    wrote = [where for _, own, where in written if own and path[: len(own)] == own]
    used = [where for name, own, where in written if not own and name in names]
    beside = [where for _, own, where in written if own and path[:1] == own[:1]]
    return next((found[-1] for found in (wrote, used, beside) if found), None)


def _written(files: OddFiles, group: Group, of: Kind) -> Iterator[tuple[str, Path, SourceLocation]]:
    """List name, path (empty for a parameter) and place of what the ODD gives a record."""
    reader = AxisReader(files, group.use.name, group.scenario)
    number = files.odd.spec.scenarios.index(group.use)
    for name in group.use.parameters:
        where = files.odd.locate(("scenarios", number, "parameters", name))
        kind, path = reader.resolve(name, where)
        if kind in {"parameter", of}:
            yield name, path, where
    for axis in group.axes:
        if axis.kind in {"parameter", of}:
            yield axis.name, axis.path, axis.where


def _at(record: Any, path: Path) -> Any:
    """Return what a record has at a dotted path; None if there is no such thing."""
    for part in path:
        children = record if isinstance(record, Mapping) else getattr(record, "__dict__", {})
        if part not in children:
            return None
        record = children[part]
    return record


# --- Check what a plan would simulate before anything runs: formulas, onsets, values, plug-ins ----

BATCH = 1_024
FASTEST = parse_quantity(BOUNDS["rate"][1], Dimension.FREQUENCY)


def check_formulas(loaded: Loaded[LogicalScenario]) -> None:
    """Check the formulas and references of a scenario.

    Raises:
        InputError: What is wrong, with its place; several errors come as ``InputErrors``.
    """
    # On a map each place has its own lanes, see ``refused_places``.
    passed = list(missing_lanes(loaded.spec)) if loaded.spec.world.map else []
    found = (one for one in check_scenario(loaded.spec) if one not in passed)
    raise_all([SpecError(message, where=loaded.locate(loc)) for loc, message in found])


def check_defaults(scenario: LogicalScenario) -> list[Finding]:
    """Compute the world of a scenario at its defaults, around the vehicle of a reference driver.

    Args:
        scenario: One whose formulas and references are checked.

    Returns:
        Place and message of the first value that is not possible or not plausible; empty for none.
    """
    try:
        check_worlds([World(scenario, default_values(scenario), _usual(), 1.0, 0)])
    except InputError as error:
        return [
            (
                guilty_path(error),
                f"with the default values, {error.message}. {error.remedy}".rstrip(),
            )
        ]
    return []


@cache
def _usual() -> Architecture:
    return load_architecture(shipped("odd") / "architectures" / "reference_cc.yaml").spec


def refused_starts(
    loaded: Loaded[LogicalScenario], places: Iterable[PlaceRoad]
) -> Iterator[tuple[PlaceRoad, str]]:
    """Yield places of a scenario, each with why it cannot start there at its defaults, or nothing.

    Args:
        loaded: The scenario, on a map.
        places: Of it.
    """
    for place in places:
        spec = at_place(loaded, place).spec
        findings = [*missing_lanes(spec)] or check_defaults(spec)
        yield place, "; ".join(f"{'.'.join(map(str, loc))}: {text}" for loc, text in findings[:1])


def refused_places(expansion: Expansion, seen: set[object]) -> dict[str, dict[str, InputError]]:
    """Find the places of maps at which scenarios cannot start with some values of their sweep.

    Args:
        expansion: The test cases of a plan.
        seen: Takes which worlds have been computed, for ``check_cases``.

    Returns:
        By scenario of the ODD and by place, why.
    """
    refused: dict[str, dict[str, InputError]] = {}
    for section in expansion.sections:
        if all(axis.path != ROAD for axis in section.group.axes):
            continue
        shared = expansion.shared(section)
        found, place = refused.setdefault(shared.scenario_id, {}), place_of(shared.scenario)
        if place in found or not _is_new((shared.scenario_id, *_worlds_key(section, shared)), seen):
            continue
        lanes = list(missing_lanes(shared.scenario))
        if lanes:
            where = section.group.scenario.locate(lanes[0][0])
            found[place] = SpecError(f"{lanes[0][1]}, at place {place}", where=where)
            continue
        try:
            _check_worlds(expansion, section)
        except SpecError as error:
            found[place] = error
    return {name: found for name, found in refused.items() if found}


def left_out(
    expansion: Expansion, refused: Mapping[str, Mapping[str, InputError]]
) -> dict[str, dict[str, Any]]:
    """Give by scenario which places of its maps no test case has, though nobody left them out.

    Returns:
        Under ``refused`` why it cannot start at some that were asked for, with how many are
        ``left``; under ``maps`` those without any place, where no places were named; under
        ``first`` the one that is taken where none was asked for and there are more.
    """
    told: dict[str, dict[str, Any]] = {}
    taken: dict[str, set[str]] = {}
    for group in (section.group for section in expansion.sections):
        for axis in group.axes:
            if axis.path == ROAD and group.use.name not in taken:
                taken[group.use.name] = set(map(str, axis.values))
    for use in expansion.files.odd.spec.scenarios:
        loaded, found = expansion.files.scenarios[use.name], refused.get(use.name, {})
        item: dict[str, Any] = {}
        if found:
            why = {
                place: error.message.removesuffix(f", at place {place}")
                for place, error in found.items()
            }
            item |= {"left": len(taken[use.name]), "refused": why}
        # Who names places has seen which maps have none.
        if use.name in taken and isinstance(use.sweep.parameters.get(PLACE), str):
            with_places = {key.partition(":")[0] for key in (*taken[use.name], *found)}
            files = loaded.spec.world.map.files if loaded.spec.world.map else ()
            others = [name for name in files if PurePath(name).stem not in with_places]
            offer = Offer(loaded.spec, loaded.locate) if others else None
            item["maps"] = [name for name in others if offer and not offer.has(PurePath(name).stem)]
        if place_of(loaded.spec) and use.name not in taken and PLACE not in use.parameters:
            first, *more = islice(Offer(loaded.spec, loaded.locate), 2)
            require_posted([first], loaded.locate(("world", "place")))
            item["first"] = str(first) if more else ""
        if any(item.values()):
            told[use.name] = item
    return told


def tell_left_out(told: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Tell which places are left out, see ``left_out``, and why."""
    for name, item in told.items():
        if first := item.get("first"):
            yield (
                f"{name} takes place at {first} only, the first of its places; "
                "sweep `place: all` for every one, or name those that are meant"
            )
        if maps := item.get("maps"):
            yield f"{name} has no place on {', '.join(maps)}"
        why: dict[str, list[str]] = {}
        for place, message in item.get("refused", {}).items():
            why.setdefault(message, []).append(place)
        if why:
            each = "; ".join(f"{', '.join(places)}: {message}" for message, places in why.items())
            count = len(item["refused"])
            total = item["left"] + count
            yield f"{name}: {item['left']:,} of {total:,} places, {count:,} refused ({each})"


def check_onsets(files: OddFiles) -> None:
    """Check the onset conditions of the faults against the scenarios that they occur in.

    Raises:
        InputError: A condition names what a scenario does not have, or cannot be computed.
    """
    together = Together()
    for number, fault in enumerate(files.odd.spec.faults):
        where = files.odd.locate(("faults", number, "onset", "when"))
        with together:
            for use in files.odd.spec.scenarios:
                if fault.id in _fault_ids(use, files):
                    _check_onset(fault, files.scenarios[use.name].spec, use.name, where)
    together.finish()


def check_hooks(files: OddFiles) -> None:
    """Check that channels offer a hook for the faults inside them.

    Raises:
        InputError: A channel does not, in an architecture that has it.
    """
    found: list[InputError] = []
    for number, fault in enumerate(files.odd.spec.faults):
        is_used = any(fault.id in _fault_ids(use, files) for use in files.odd.spec.scenarios)
        if fault.port != "hooks" or not is_used:
            continue
        for name, item in files.architectures.items():
            channel = item.spec.channels.get(fault.target_id)
            if channel is None:
                continue
            made = make_channel(channel.kind, item.path.parent)
            hooks: tuple[str, ...] = tuple(getattr(made, "hooks", ()))
            if fault.model not in hooks:
                error = SpecError(
                    f"fault {fault.id}: channel {fault.target_id} of architecture {name} "
                    f"({channel.kind}) has no hook {fault.model}",
                    where=files.odd.locate(("faults", number, "model")),
                    remedy=f"It has {', '.join(hooks) or 'none'}; see HookedChannel.",
                )
                found.append(error)
    raise_all(found)


def check_fits(files: OddFiles) -> None:
    """Check that what each fault does has a meaning for its target in every architecture.

    Raises:
        InputError: What has none, with its place; several errors come as ``InputErrors``.
    """
    together = Together()
    for number, fault in enumerate(files.odd.spec.faults):
        where = files.odd.locate(("faults", number, "delay"))
        with together:
            _check_delay(fault, files.odd.spec.step, where)
        for item in files.architectures.values():
            for loc, text in _misfits(fault, item.spec):
                with together:
                    raise SpecError(text, where=files.odd.locate(("faults", number, *loc)))
    together.finish()


def over_budget(concept: Concept) -> Iterator[str]:
    """Say where the detection and reaction times of FSRs exceed the FTTI of their goal.

    An FSR that has both stands for itself; of those with one of them only, the longest detection
    and the longest reaction of a goal belong together.

    Source:
        ISO 26262-3:2018, 7.4.2.4: a fault is handled within its fault tolerant time interval.
    """
    for goal in concept.safety_goals:
        for budget in budgets_of(concept.requirements, goal.id):
            if budget.exceeds(goal.ftti):
                parts = [("FDTI", budget.fdti), ("FRTI", budget.frti)]
                said = [f"{word} {time:g} s" for word, time in parts if time is not None]
                yield (
                    f"{goal.id}: {' and '.join(said)} of {' and '.join(budget.fsrs)} "
                    f"{'exceed' if len(said) > 1 else 'exceeds'} its FTTI of {goal.ftti:g} s"
                )


def same_architectures(files: OddFiles, parts: Mapping[str, Parts]) -> Iterator[str]:
    """Say which architectures are one under several ids, and which the gate names twice."""
    gate = files.odd.spec.gate
    for name, count in Counter(gate.architectures if gate else ()).items():
        if count > 1:
            yield f"the gate names {name} {count} times; it counts once"
    known: dict[tuple[str, str], str] = {}
    for name, item in files.architectures.items():
        first = known.setdefault((content_digest(item.spec), parts[name].digest), name)
        if first != name:
            yield (
                f"architecture {name} is {first} under another id: each run is executed once, and "
                "both have its result"
            )


def same_scenarios(expansion: Expansion) -> Iterator[str]:
    """Say which test cases of a scenario are those of another one, or of a copy of it.

    A copy of a file has an id of its own, which its random draws depend on, and nothing else.
    """
    alike: dict[str, dict[str, list[Section]]] = {}
    for section in expansion.sections:
        shared = expansion.shared(section)
        faults = [fault.executable() for fault in shared.faults]
        parts = [nameless_digest(shared.scenario), content_digest(shared.architecture), faults]
        key = digest(parts)
        uses = alike.setdefault(f"{shared.architecture.architecture} {key}", {})
        uses.setdefault(shared.scenario_id, []).append(section)
    repeated: Counter[tuple[str, str]] = Counter()
    for uses in alike.values():
        seen: dict[tuple[str, int], str] = {}
        for name, sections in uses.items() if len(uses) > 1 else ():
            for section in sections:
                for columns in expansion.columns(section.first, section.end):
                    for case in zip(columns.parameters_json, columns.replicate, strict=True):
                        first = seen.setdefault(case, name)
                        repeated[name, first] += first != name
    planned = Counter[str]()
    for factor in expansion.factors:
        planned[factor.scenario] += factor.test_cases
    for (name, first), count in repeated.items():
        if count:
            yield (
                f"{count:,} of {planned[name]:,} test cases of {name} are those of {first} under "
                "another name; equal results count once, and others differ by random draws only, "
                "as replicates do"
            )


def check_cases(expansion: Expansion, seen: set[object] | None = None) -> tuple[str, ...]:
    """Check what a sweep makes of the files: every variant and every value of the worlds.

    Every point is looked at, ``BATCH`` of them at a time; a variant, and a world that only
    replicates, faults or sensors tell from another, once.

    Args:
        expansion: The test cases of the plan.
        seen: What has been checked already, see ``refused_places``.

    Returns:
        What the user should know of its axes; no error.

    Raises:
        SweepError: A variant is not valid, a point is outside an ODD that refuses such, or an axis
            makes no difference to any run.
        SpecError: A variant of a scenario or of a plug-in's parameters is not valid, an onset
            condition is not, a fault never acts at some point, or a value is not possible.
    """
    files = expansion.files
    sweeps = {
        use.name: files.odd.locate(("scenarios", number, "sweep"))
        for number, use in enumerate(files.odd.spec.scenarios)
    }
    seen = set() if seen is None else seen
    for section in expansion.sections:
        shared = expansion.shared(section)
        where = sweeps[shared.scenario_id]
        faults = digest([fault.executable() for fault in shared.faults])
        if _is_new((shared.scenario_id, content_digest(shared.scenario), faults), seen):
            _check_variant(files, section, shared)
        loaded = section.group.architecture
        is_varied = shared.architecture is not loaded.spec
        if is_varied and _is_new(content_digest(shared.architecture), seen):
            _check_parts(loaded, shared, where)
        run = shared.scenario.horizon + shared.scenario.tail
        if _is_new((content_digest(shared.architecture), faults, run), seen):
            _check_plausible(files, section, shared, run)
            for fault in shared.faults:
                _check_delay(fault, shared.step, where, "with the swept values, ")
                for _, text in _misfits(fault, shared.architecture):
                    raise SpecError(f"with the swept values, {text}", where=where)
        if _is_new((shared.scenario_id, *_worlds_key(section, shared)), seen):
            _check_worlds(expansion, section)
        _check_presence(files, section, shared, seen)
    return _check_axes(expansion)


def _check_presence(files: OddFiles, section: Section, shared: Shared, seen: set[object]) -> None:
    """Check that every fault can be present at a tick up to the horizon, at every point.

    Obligations begin within the horizon: a fault that comes later is tested by none of them.
    """
    scenario, step = shared.scenario, shared.step
    end = round((scenario.horizon + scenario.tail) / step)
    # Nothing is decided from the last row.
    time = tick_times(np.arange(min(round(scenario.horizon / step), end - 1) + 1), step)
    points, varied = section.group.points, {axis.name for axis in section.group.axes}
    for fault in shared.faults:
        when = fault.onset.when
        names = sorted(when.names & shared.parameters.keys()) if when is not None else []
        values = np.array([[shared.parameters[name] for name in names]])
        if varied.intersection(names):
            columns = [
                points.column(name, section.rows)
                if name in varied
                else value.repeat(len(section.rows))
                for name, value in zip(names, values.T, strict=True)
            ]
            values = np.unique(np.stack(columns, axis=1).astype(np.float64), axis=0)
        elif not _is_new((scenario.horizon, scenario.tail, values.tobytes(), fault), seen):
            continue
        for first in range(0, len(values), BATCH):
            part = values[first : first + BATCH]
            why = _absence(fault, time, {name: part[:, [at]] for at, name in enumerate(names)})
            if why:
                raise SpecError(
                    f"fault {fault.id} never acts in scenario {shared.scenario_id}: {why}",
                    where=_onset_place(files, section, fault),
                    remedy=f"Obligations begin up to the horizon of {scenario.horizon:g} s, and "
                    f"decisions are taken every {step:g} s: let it be present at one of them.",
                )


def _absence(fault: Fault, time: Floats, parameters: Mapping[str, Floats]) -> str:
    """Say why a fault is never present at the times of the decisions; empty if it may be."""
    onset, duration = fault.onset, math.inf if fault.duration is None else fault.duration
    if duration <= TIME_TOLERANCE:
        return f"it lasts {duration:g} s"
    if onset.when is not None:
        holds = np.atleast_2d(may_hold(onset.when.steps, {**parameters, "time": time}))
        never = np.flatnonzero(~holds.any(axis=1))
        values = [
            f"{name} = {float(item[never[0], 0]):g}"
            for name, item in parameters.items()
            if len(never)
        ]
        said = f" with {' and '.join(values)} in SI" if values else ""
        return f"'{onset.when.text}' cannot hold{said}" if len(never) else ""
    latest = onset.between[1] if onset.between is not None else onset.at or 0.0
    if latest > time[-1] + TIME_TOLERANCE:
        return f"it begins at {latest:g} s"
    if onset.between is not None:
        return ""
    gone = np.floor((time - latest + TIME_TOLERANCE) / (fault.every or math.inf))
    again = np.minimum(gone, (fault.times or math.inf) - 1.0) * (fault.every or 0.0)
    begun = latest + (again if fault.every is not None else 0.0)
    is_present = (time >= latest - TIME_TOLERANCE) & (time < begun + duration - TIME_TOLERANCE)
    if is_present.any():
        return ""
    return f"it lasts {duration:g} s from {latest:g} s on, between two decisions"


def _onset_place(files: OddFiles, section: Section, fault: Fault) -> SourceLocation:
    """Find what made a fault never act: an axis that varies it, or where it is written."""
    for axis in section.group.axes:
        if axis.kind == "faults" and axis.path[0] == fault.id:
            return axis.where
    number = [item.id for item in files.odd.spec.faults].index(fault.id)
    onset = fault.onset
    key = "when" if onset.when is not None else "at" if onset.at is not None else "between"
    is_short = fault.duration is not None and fault.duration <= TIME_TOLERANCE
    loc: Loc = ("duration",) if is_short else ("onset", key)
    return files.odd.locate(("faults", number, *loc))


def _check_axes(expansion: Expansion) -> tuple[str, ...]:
    """Check that every axis makes a difference to some run: else it counts one run many times.

    Returns:
        A notice of each that only chooses among the points of others.
    """
    used: dict[str, set[str]] = {}
    alike: dict[object, Section] = {}
    for section in expansion.sections:
        shared, group = expansion.shared(section), section.group
        onsets = [fault.onset.when for fault in shared.faults]
        names = used.setdefault(shared.scenario_id, set())
        names |= _moving(section, shared)
        names |= {name for when in onsets if when is not None for name in when.names}
        heeded = _heeded(shared.architecture, expansion.files)
        records = (content_digest(shared.scenario), content_digest(heeded))
        faults = digest([fault.executable() for fault in shared.faults])
        other = alike.setdefault((id(group), *records, faults), section)
        for axis in group.axes if other is not section else ():
            levels = group.points.levels[axis.name]
            pair = [axis.texts[int(levels[item.rows[0]])] for item in (other, section)]
            if axis.kind != "parameter" and pair[0] != pair[1]:
                raise SweepError(
                    f"{axis.name}: no run differs between {pair[0]} and {pair[1]}",
                    where=axis.where,
                    remedy="Vary what runs depend on; texts, tags, costs and sensors that nothing "
                    "is linked to are no part of them.",
                )
    notices: dict[str, None] = {}
    for section in expansion.sections:
        use = section.group.use
        relations = (*use.sweep.where, *expansion.files.scenarios[use.name].spec.constraints)
        chosen_by = frozenset[str]().union(*(item.names for item in relations))
        for axis in section.group.axes:
            if axis.kind != "parameter" or axis.name in used[use.name]:
                continue
            said = f"{axis.name}: nothing that happens in scenario {use.name} depends on it"
            if axis.name not in chosen_by:
                raise SweepError(
                    f"{said}, so that each of its values would count the same run again",
                    where=axis.where,
                    remedy="Use it in the scenario or take it out of the sweep; for more samples "
                    "of the noise there are replicates.",
                )
            notices[f"{said}; it only chooses points, and its values are replicates"] = None
    return tuple(notices)


def _moving(section: Section, shared: Shared) -> set[str]:
    """Name the parameters that change a formula of the scenario at some point of a section.

    ``speed + 0 m/s^2 * delay`` names one that changes nothing. Of what also hangs on signals the
    parts count that do not. A parameter that has one value is taken as it is written.
    """
    points, rows = section.group.points, section.rows
    varied: dict[str, Any] = {}
    for axis in section.group.axes:
        if axis.kind == "parameter":
            column = points.column(axis.name, rows)
            if (column != column[0]).any():
                varied[axis.name] = column
    parts = (item.parts_of(shared.parameters) for item in formulas_used(shared.scenario))
    found: set[str] = set()
    for part in chain.from_iterable(parts):
        columns = {name: varied.get(name, shared.parameters[name]) for name in part.names}
        found |= {
            name
            for name in part.names - found
            if name not in varied or _changes(part, columns, name, len(rows))
        }
    return found


def _changes(part: Expression, columns: Mapping[str, Any], name: str, size: int) -> bool:
    """Tell whether a formula is another at some point than with the first value of a name."""
    for start in range(0, size, BATCH):
        here = {
            other: column[start : start + BATCH] if isinstance(column, np.ndarray) else column
            for other, column in columns.items()
        }
        try:
            held = part.evaluate({**here, name: columns[name][0]})
            if not np.all(part.evaluate(here) == held):
                return True
        except InputError:
            return True
    return False


def _heeded(architecture: Architecture, files: OddFiles) -> Architecture:
    """Leave out the sensors that no channel is linked to and no FSR reads."""
    if files.odd.spec.plugins:
        # A metric of one's own may read any.
        return architecture
    channels = architecture.channels.values()
    linked = {link.removeprefix(HEALTH) for channel in channels for link in channel.links}
    kept = {
        name: sensor
        for name, sensor in architecture.sensors.items()
        if name in linked
        or any(
            f"sensor.{name}." in (item.formula or "") for item in files.concept.spec.requirements
        )
    }
    is_whole = len(kept) == len(architecture.sensors)
    return architecture if is_whole else architecture.model_copy(update={"sensors": kept})


def _is_new(key: object, seen: set[object]) -> bool:
    is_new = key not in seen
    seen.add(key)
    return is_new


def _worlds_key(section: Section, shared: Shared) -> tuple[object, ...]:
    """Tell which sections have the same worlds: neither faults nor sensors are in them."""
    levels = section.group.points.levels
    values = hashlib.sha256()
    for axis in section.group.axes:
        if axis.kind == "parameter":
            values.update(axis.name.encode() + levels[axis.name][section.rows].tobytes())
    return content_digest(shared.scenario), shared.architecture.vehicle, values.digest()


def _fault_ids(use: ScenarioUse, files: OddFiles) -> set[str]:
    if use.faults is None:
        return {fault.id for fault in files.odd.spec.faults}
    return {
        name for entry in use.faults for name in ((entry,) if isinstance(entry, str) else entry)
    }


def _check_onset(fault: Fault, scenario: LogicalScenario, name: str, where: SourceLocation) -> None:
    condition = fault.onset.when
    if condition is None:
        return
    known = trigger_variables(scenario)
    for variable in sorted(condition.names - known.keys()):
        raise SpecError(
            f"fault {fault.id}: scenario {name} has nothing named {variable!r}",
            where=where,
            remedy=suggest(variable, known),
        )
    with placed(where, f"fault {fault.id}: ", caught=ExpressionError):
        require_dimension(condition, Dimension.NONE, dict(known))
        to_program(condition, {variable: at for at, variable in enumerate(known)})


def _misfits(fault: Fault, architecture: Architecture) -> list[tuple[Loc, str]]:
    """Say what of a fault has no meaning for its target, which an architecture need not have."""
    sensor = architecture.sensors.get(fault.target_id)
    if not isinstance(fault, SensorFault) or sensor is None:
        return []
    what = f"fault {fault.id}: {fault.target} of {architecture.architecture}"
    return [(loc, f"{what}: {text}") for loc, text in fault.misfits(sensor)]


def _check_delay(fault: Fault, step: float, where: SourceLocation, said: str = "") -> None:
    """Check that a late switch is late by whole ticks, as its handover is long."""
    if isinstance(fault, Late):
        with placed(where, said):
            ticks(fault.delay, step, f"fault {fault.id}: delay")


def _check_variant(files: OddFiles, section: Section, shared: Shared) -> None:
    where, loaded = section.group.where, files.scenarios[shared.scenario_id]
    check_driver_words(replace(loaded, spec=shared.scenario))
    written = loaded.spec
    if shared.scenario is not written:
        if _driven_by(shared.scenario) != _driven_by(written):
            # A result names the FMU of its scenario, not that of a variant.
            raise SpecError(
                "with the swept values, another FMU drives an actor",
                where=where,
                remedy="Write a scenario for each, with extends.",
            )
        for loc, message in check_scenario(shared.scenario, files.odd.spec.beyond_plausible):
            path = tuple(map(str, loc))
            place = author(files, section.group, shared.scenario, path)
            said = f"{'.'.join(path)}: {message.removeprefix('.'.join(path) + ': ')}"
            raise SpecError(f"with the swept values, {said}", where=place or where)
    planned = {fault.id: fault for fault in files.odd.spec.faults}
    for fault in shared.faults:
        if fault is not planned[fault.id]:
            _check_onset(fault, shared.scenario, shared.scenario_id, where)


def _driven_by(scenario: LogicalScenario) -> dict[str, tuple[str, str]]:
    return {name: (item.file, item.digest) for name, item in scenario.drivers.items()}


def _check_parts(loaded: Loaded[Any], shared: Shared, where: SourceLocation) -> None:
    with placed(where, "with the swept values, ", caught=InputError):
        parts = load_code(varied := replace(loaded, spec=shared.architecture))
        check_words(varied)
        is_other = named_files(shared.architecture) != named_files(loaded.spec)
        if is_other or parts.digest != load_code(loaded).digest:
            # A result names the code of its architecture, not that of a variant.
            raise SpecError(
                "another plug-in, policy or file that it reads is named",
                remedy="Write an architecture for each, with extends.",
            )


def _check_plausible(files: OddFiles, section: Section, shared: Shared, run: float) -> None:
    """Check the values that a sweep wrote, and that nothing takes longer than a run."""
    group, odd, architecture = section.group, files.odd, shared.architecture
    limits = {**architecture.own_limits(), "delay": (0.0, run), "rate": (1.0 / run, FASTEST)}
    lifted = odd.spec.beyond_plausible
    of_file = {*lifted, *architecture.beyond_plausible}
    found: list[tuple[Implausible, SourceLocation]] = []
    for item in implausible(architecture, of_file, limits):
        if not is_written(architecture, item.loc):
            continue
        where = group.architecture.locate(item.loc)
        if architecture is not group.architecture.spec:
            path = tuple(map(str, item.loc))
            where = author(files, group, architecture, path, "architecture") or where
        found.append((item, where))
    for number, fault in zip(group.faults, shared.faults, strict=True):
        for item in implausible(fault, lifted, limits, loc=("faults", number)):
            where = odd.locate(item.loc)
            if fault is not odd.spec.faults[number]:
                path = (fault.id, *map(str, item.loc[2:]))
                where = author(files, group, fault, path, "faults") or where
            found.append((item, where))
    for item, where in found:
        said = f"{item.text}, where a run of {shared.scenario_id} takes {run:g} s"
        raise SpecError(said, where=where, remedy=item.remedy)


def is_written(record: Any, loc: Loc) -> bool:
    """Tell whether a file says what is at a place of a record: nobody can correct a default."""
    for part in loc:
        if isinstance(record, BaseModel):
            if part not in record.model_fields_set:
                return False
            record = getattr(record, str(part))
        else:
            record = record[part]
    return True


def _check_worlds(expansion: Expansion, section: Section) -> None:
    """Compute the initial worlds; a message begins with the dotted path of its formula."""
    size = BATCH * section.replicates
    for columns in expansion.columns(section.first, section.end, size):
        try:
            check_worlds(columns.worlds(), expansion.files.odd.spec.beyond_plausible)
        except InputError as error:
            if error.where is not None:
                raise
            group = section.group
            scenario = expansion.shared(section).scenario
            path = guilty_path(error)
            place = author(expansion.files, group, scenario, path)
            said = error.message if place is None else f"with the ODD's values, {error.message}"
            if scenario.world.map is not None:
                said += f", at place {place_of(scenario)}"
            where = place or group.scenario.locate(path)
            raise SpecError(said, where=where, remedy=error.remedy) from error
