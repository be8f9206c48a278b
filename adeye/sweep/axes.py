"""Axes of a sweep: what each varies, its values, and how many points a design has."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from adeye.errors import (
    InputError,
    InputErrors,
    SourceLocation,
    SpecError,
    SweepError,
    placed,
    suggest,
)
from adeye.kernel.relation import differences
from adeye.spec.document import validate
from adeye.spec.odd import Axis as AxisSpec
from adeye.spec.odd import Distribution, Level, Steps
from adeye.spec.places import PLACE, ROAD, Offer, PlaceRoad, choose_places
from adeye.spec.quantity import Record
from adeye.sweep.distributions import Law, law_of, levels_of, of_axis, require_within
from adeye.sweep.values import SAME, are_same, quantity_or_text
from adeye.units import shown

if TYPE_CHECKING:
    from adeye.spec.fault import Fault
    from adeye.spec.load import Loaded, OddFiles
    from adeye.spec.scenario import LogicalScenario, Parameter, Value

# --- Axes of a sweep: what each varies, its values, and how many points a design has --------------

Kind = Literal["parameter", "scenario", "architecture", "faults"]
MAX_AXIS_VALUES = 1_000_000
_QUANTITY = re.compile(
    r"\s*([-+]?(?:[0-9]{1,30}(?:\.[0-9]{0,30})?|\.[0-9]{1,30})(?:[eE][-+]?[0-9]{1,3})?)\s*(\S*)\s*"
)


@dataclass(frozen=True, slots=True)
class Axis:
    """One varied quantity.

    Attributes:
        name: As the sweep writes it.
        kind: What it varies: a scenario parameter, or a place in a file by dotted path.
        path: The dotted path below its file, empty for a parameter.
        texts: The values as written, one per level.
        values: The same in SI, or text where a value is not a quantity.
        where: Its place in the ODD file.
        law: How its values are distributed, where the sweep declares it; then texts and values are
            the levels of a choice, else some that tell the unit.
    """

    name: str
    kind: Kind
    path: tuple[str, ...]
    texts: tuple[Level, ...]
    values: tuple[float | str, ...]
    where: SourceLocation
    law: Law | None = None

    def __len__(self) -> int:
        """Number of levels."""
        return len(self.texts)


@dataclass(frozen=True, slots=True)
class AxisReader:
    """Reads the axes of one scenario use.

    Attributes:
        files: The ODD and everything it names.
        use_name: Id of the scenario in the ODD.
        scenario: Its file.
        refused: Places of its maps at which it cannot start, and why.
    """

    files: OddFiles
    use_name: str
    scenario: Loaded[LogicalScenario]
    refused: Mapping[str, InputError] = field(default_factory=dict)

    def read(
        self, name: str, spec: AxisSpec, where: SourceLocation, *, distinct: bool = True
    ) -> Axis:
        """Turn one axis of a sweep into its levels.

        Args:
            name: A scenario parameter or a dotted path.
            spec: A list of values, evenly spaced steps or a distribution.
            where: Its place in the ODD file.
            distinct: Whether a value may occur only once, as in a full factorial.

        Raises:
            SweepError: Unknown name, empty axis, a value of the wrong unit or out of range.
        """
        if self._is_place(name):
            return self._places(spec, where, distinct=distinct)
        if isinstance(spec, str):
            raise SweepError(
                f"{shown(spec)} is for the axis place of a scenario on a map",
                where=where,
                remedy="Write a list of values.",
            )
        with of_axis(name, where):
            texts = _steps(spec) if isinstance(spec, Steps) else levels_of(spec)
            if not (texts or isinstance(spec, Distribution)):
                raise SweepError("the axis has no values", remedy="List some.")
        kind, path = self.resolve(name, where)
        parameter = self.scenario.spec.parameters.get(name)
        with of_axis(name, where):
            _check_varied(kind, path)
            if isinstance(spec, Distribution) and spec.choice is None:
                law, texts, values = self._drawn(spec, parameter)
                return Axis(name, kind, path, texts, values, where, law)
            values = tuple(
                quantity_or_text(text)[0] if parameter is None else parameter_value(parameter, text)
                for text in texts
            )
            _check_looked_at(kind, path, values)
            if distinct:
                _require_distinct(texts, values)
        choice = spec.choice if isinstance(spec, Distribution) else None
        weighted = None if choice is None else Law("choice", weights=tuple(choice.values()))
        return Axis(name, kind, path, texts, values, where, weighted)

    def resolve(self, name: str, where: SourceLocation) -> tuple[Kind, tuple[str, ...]]:
        """Tell what a name varies, and refuse one that nothing has."""
        parameters = self.scenario.spec.parameters
        if name in parameters:
            return "parameter", ()
        if self._is_place(name):
            return "scenario", ROAD
        head, *rest = name.split(".")
        path = tuple(rest)
        with of_axis(name, where):
            if head == "architecture" and path:
                architectures = [item.spec for item in self.files.architectures.values()]
                _require_path(architectures, path, "no architecture has this path")
                return "architecture", path
            if head == "scenario" and self.scenario.spec.world.map and _is_of_places(path):
                raise SweepError(
                    "this is what the place of a map decides",
                    remedy="Vary the place by the axis place.",
                )
            if head == "scenario" and path:
                said = f"scenario {self.use_name} has no such path"
                _require_path([self.scenario.spec], path, said)
                return "scenario", path
            if head == "faults" and len(path) >= 2:
                faults = {fault.id: fault for fault in self.files.odd.spec.faults}
                if path[0] not in faults:
                    remedy = suggest(path[0], faults)
                    raise SweepError(f"there is no fault {path[0]!r}", remedy=remedy)
                said = f"a fault has no {'.'.join(path[1:])}"
                _require_path([faults[path[0]]], path[1:], said)
                return "faults", path
        raise SweepError(
            f"{name!r} is neither a parameter of scenario {self.use_name} nor a dotted path that "
            "begins with scenario., architecture. or faults.",
            where=where,
            remedy=suggest(name, sorted(parameters)),
        )

    def _is_place(self, name: str) -> bool:
        """Tell whether a name is that of the axis that takes places of the scenario's maps."""
        is_on_map = self.scenario.spec.world.map is not None
        return name == PLACE and is_on_map and name not in self.scenario.spec.parameters

    def _places(self, spec: AxisSpec, where: SourceLocation, *, distinct: bool) -> Axis:
        """Read which places of its maps the scenario takes.

        One that is refused is left out, unless somebody named it or no other is left.
        """
        if isinstance(spec, Steps | Distribution):
            raise SweepError(
                "places are no quantity",
                where=where,
                remedy="Write all, first N, sample N seed K, or a list of keys.",
            )
        offer = Offer(self.scenario.spec, self.scenario.locate)
        with placed(where, f"{PLACE}: ", raised=SweepError):
            chosen = choose_places(offer, spec)
            if not chosen:
                raise SpecError("no place is chosen", remedy="Name one, or write all.")
        with placed(where, f"{PLACE}: ", caught=SweepError, raised=SweepError):
            _require_distinct(chosen, chosen)
        left = tuple(place for place in chosen if place not in self.refused)
        if len(left) < len(chosen):
            if not left or not (distinct and isinstance(spec, str)):
                raise next(self.refused[place] for place in chosen if place in self.refused)
            chosen = left
        return Axis(PLACE, "scenario", ROAD, chosen, tuple(map(str, chosen)), where)

    def _drawn(
        self, spec: Distribution, parameter: Parameter | None
    ) -> tuple[Law, tuple[Level, ...], tuple[float | str, ...]]:
        """Read a law, texts that tell its unit, and these in SI."""
        if parameter is None:
            raise SweepError(
                f"a {spec.kind} distribution is for scenario parameters only",
                remedy="Use choice for a path.",
            )
        read = partial(parameter_quantity, parameter)
        law, texts = law_of(spec, self.files.odd.path.parent, read)
        if parameter.range is not None:
            require_within(law, ends_of(parameter.range))
        return law, texts, tuple(map(read, texts))


def _is_of_places(path: tuple[str, ...]) -> bool:
    """Tell whether a dotted path leads to what chooses places of a map, or to the road of one."""
    return path[0] == "world" and (len(path) == 1 or path[1] in {"map", "place", "road"})


def _check_varied(kind: Kind, path: tuple[str, ...]) -> None:
    """Refuse what makes another thing of the file: its id, its plug-ins, a fault's target."""
    if kind == "parameter":
        return
    fixed = (
        path == (kind,)
        or (kind == "scenario" and path[0] == "parameters")
        or (kind == "faults" and path[1:] in {("id",), ("target",), ("model",)})
        or (kind == "architecture" and path[0] != "vehicle" and path[-1] == "kind")
    )
    if fixed:
        what = kind.removesuffix("s")
        remedy = "Vary the parameter by its own name." if path[0] == "parameters" else ""
        raise SweepError(
            f"this tells one {what} from another and cannot vary",
            remedy=remedy or f"Write another {what} beside it.",
        )


def _check_looked_at(kind: Kind, path: tuple[str, ...], values: Sequence[Any]) -> None:
    """Refuse to vary how long one looks: one drive would count as several results."""
    ends = path in {("horizon",), ("tail",)} or path[:2] == ("ego", "goal")
    if kind == "scenario" and ends and len(values) > 1:
        raise SweepError(
            f"what happens is the same however long one looks, and would count {len(values)} times",
            remedy="Give one value, the longest that is needed.",
        )


def ends_of(limits: Sequence[Value]) -> tuple[float, float]:
    """Return the ends of a parameter's range in SI."""
    low, high = (float(quantity_or_text(end)[0]) for end in limits)
    return low, high


def parameter_value(parameter: Parameter, text: Level) -> float:
    """Read a value of a scenario parameter in the unit family of its default.

    Raises:
        SweepError: Not a quantity, another unit, or outside the parameter's range.
    """
    value = parameter_quantity(parameter, text)
    if parameter.range is not None:
        low, high = ends_of(parameter.range)
        is_inside = low <= value <= high
        if not is_inside and not differences(value, low) >= 0.0 >= differences(value, high):
            raise SweepError(
                f"{text} is outside the scenario's range "
                f"[{parameter.range[0]}, {parameter.range[1]}]",
                remedy="Narrow the sweep or widen the range in the scenario.",
            )
    return value


def parameter_quantity(parameter: Parameter, text: Level) -> float:
    """Read a quantity in the unit family of a parameter's default, whatever its range.

    Raises:
        SweepError: Not a quantity, or another unit.
    """
    value, dimension = quantity_or_text(text)
    _, expected = quantity_or_text(parameter.default)
    if isinstance(value, str) or dimension is None or expected is None:
        told = value if isinstance(text, bool | tuple) else repr(text)
        raise SweepError(f"{told} is not a quantity like {parameter.default!r}")
    if dimension.exponents != expected.exponents:
        raise SweepError(
            f"{text!r} is {dimension.label}, not {expected.label}",
            remedy=f"Write it like {parameter.default!r}.",
        )
    return value


def default_values(scenario: LogicalScenario) -> dict[str, float]:
    """Resolve the default of every parameter in SI."""
    return {
        name: parameter_value(parameter, parameter.default)
        for name, parameter in scenario.parameters.items()
    }


def _children(value: Any) -> Mapping[str, Any]:
    if isinstance(value, Mapping):
        return value
    fields = getattr(type(value), "model_fields", None)
    return {name: getattr(value, name) for name in fields} if fields else {}


def _require_path(records: Sequence[Any], path: tuple[str, ...], said: str) -> None:
    """Refuse a path that no record has, and name what there is where it leaves them."""
    if any(has_path(record, path) for record in records):
        return
    known: dict[str, None] = {}
    for record in records:
        found = record
        for part in path:
            children = _children(found)
            if part not in children:
                known |= dict.fromkeys(children)
                break
            found = children[part]
    there = f"There are: {', '.join(known)}." if known else "Check the path."
    raise SweepError(said, remedy=there)


def has_path(record: Any, path: tuple[str, ...]) -> bool:
    """Tell whether a spec record has a field at a dotted path."""
    for part in path:
        children = _children(record)
        if part not in children:
            return False
        record = children[part]
    return True


def _require_distinct(texts: Sequence[Level], values: Sequence[object]) -> None:
    first: dict[object, Level] = {}
    for text, value in zip(texts, values, strict=True):
        if value in first:
            pair = " and ".join(dict.fromkeys((shown(first[value]), shown(text))))
            raise SweepError(f"a value occurs twice, as {pair}", remedy="Remove one.")
        first[value] = text
    numbers = sorted(value for value in first if isinstance(value, float))
    for low, high in pairwise(numbers):
        if are_same(low, high):
            pair = " and ".join(shown(first[value]) for value in (low, high))
            raise SweepError(
                f"two values are the same but for a part of {SAME:g}, {pair}",
                remedy="Remove one.",
            )


def _steps(steps: Steps) -> tuple[Value, ...]:
    ends = [_split(text) for text in (steps.start, steps.to, steps.step)]
    units = {unit for _, unit in ends}
    if len(units) != 1:
        raise SweepError(
            f"from, to and step have different units: {sorted(units)}",
            remedy="Write all three in one unit.",
        )
    (start, unit), (stop, _), (step, _) = ends
    if step <= 0 or stop < start:
        raise SweepError(
            f"from {steps.start} to {steps.to} in steps of {steps.step} is empty",
            remedy="The step must be positive and `to` not below `from`.",
        )
    # A fraction, because decimals of very different size cannot be divided without rounding.
    intervals = (Fraction(stop) - Fraction(start)) / Fraction(step)
    if intervals >= MAX_AXIS_VALUES:
        raise SweepError(
            f"more than {MAX_AXIS_VALUES:,} values",
            remedy="Take a larger step.",
        )
    if intervals.denominator != 1:
        nearest = [f"{start + step * k} {unit}".strip() for k in _around(intervals)]
        raise SweepError(
            f"{steps.to} is not reached in steps of {steps.step} from {steps.start}",
            remedy=f"The nearest ends are {' and '.join(nearest)}.",
        )
    levels = [start + step * k for k in range(int(intervals) + 1)]
    if unit:
        return tuple(f"{level} {unit}" for level in levels)
    is_whole = all(level == level.to_integral_value() for level in (start, step))
    return tuple(int(level) if is_whole else float(level) for level in levels)


def _around(number: Fraction) -> tuple[int, int]:
    return math.floor(number), math.floor(number) + 1


def _split(text: Value) -> tuple[Decimal, str]:
    match = _QUANTITY.fullmatch(str(text))
    number = Decimal(match[1]) if match is not None else Decimal("NaN")
    # Larger or finer numbers are no quantities, and would be written out digit by digit.
    if match is None or number.adjusted() > 300 or int(number.as_tuple().exponent) < -300:
        raise SweepError(f"{shown(text)} is not a quantity", remedy="Write it like 15 m.")
    return number, match[2]


# --- Apply swept values to scenarios, architectures and faults by dotted path, once per variant ---

Spec = TypeVar("Spec", bound=Record)
Path = tuple[str, ...]
MOST_VARIANTS = 4_096
"""Records of changed files that are kept, so that a sweep over files stays small too."""


@dataclass(frozen=True, slots=True)
class Change:
    """A value that the sweep writes into a file.

    Attributes:
        path: Dotted path below the file.
        value: As written.
        where: Place of the axis, for messages.
    """

    path: Path
    value: Level
    where: SourceLocation = field(compare=False)

    def __str__(self) -> str:
        """Write it as ``path = value``."""
        shown = self.value
        if isinstance(shown, bool | tuple):
            shown, _ = quantity_or_text(shown)
        return f"{'.'.join(self.path)} = {shown}"


@dataclass(frozen=True)
class Variants:
    """The variants of one file, made once for each distinct set of changes.

    A shared record per variant keeps a plan of many test cases small and lets a batch tell by
    identity which runs have one content. Only the newest are kept.
    """

    _kept: dict[tuple[int, tuple[Change, ...]], Any] = field(default_factory=dict)

    def of(self, loaded: Loaded[Spec], changes: tuple[Change, ...]) -> Spec:
        """Return the record of a file with changes applied.

        Raises:
            SweepError: The changed content is not valid.
        """
        return self._made(id(loaded), loaded.spec, loaded.content, changes)

    def fault(self, fault: Fault, content: Mapping[str, Any], changes: tuple[Change, ...]) -> Fault:
        """Return a fault with changes applied.

        Raises:
            SweepError: The changed content is not valid.
        """
        return self._made(id(fault), fault, content, changes)

    def _made(
        self, of: int, spec: Spec, content: Mapping[str, Any], changes: tuple[Change, ...]
    ) -> Spec:
        if not changes:
            return spec
        if (of, changes) not in self._kept:
            made = _changed(spec, content, changes)
            if len(self._kept) >= MOST_VARIANTS:
                self._kept.clear()
            self._kept[of, changes] = made
        kept: Spec = self._kept[of, changes]
        return kept


def with_path(content: Mapping[str, Any], path: Path, value: Any) -> dict[str, Any]:
    """Return content with a value at a dotted path; what the file left out is made on the way.

    What is not on the way is shared, not copied: the road of a place has thousands of numbers.
    """
    name, *rest = path
    child = content.get(name)
    inner = child if isinstance(child, Mapping) else {}
    return {**content, name: with_path(inner, tuple(rest), value) if rest else value}


@dataclass(frozen=True)
class _Changed:
    """Changed content; what is wrong with it is wrong at the axis that changed it."""

    value: Any
    changes: tuple[Change, ...]

    def locate(self, loc: tuple[str | int, ...]) -> SourceLocation:
        """Find the axis that wrote a part, or the last one."""
        wrote = [change for change in self.changes if loc[: len(change.path)] == change.path]
        return (wrote or self.changes)[-1].where

    def locate_key(self, loc: tuple[str | int, ...]) -> SourceLocation:
        """Find the axis that wrote the key of a part, or the last one."""
        return self.locate(loc)

    def heir(self, loc: tuple[str | int, ...]) -> str:  # noqa: ARG002 - nothing is inherited
        """Return no file: the axis writes into the file as a whole."""
        return ""


def _changed(spec: Spec, content: Mapping[str, Any], changes: tuple[Change, ...]) -> Spec:
    changed = content
    for change in changes:
        value: Any = list(change.value) if isinstance(change.value, tuple) else change.value
        value = dict(value.content) if isinstance(value, PlaceRoad) else value
        changed = with_path(changed, change.path, value)
    try:
        made = validate(_Changed(changed, changes), type(spec))
    except InputError as error:
        first = error.errors[0] if isinstance(error, InputErrors) else error
        what = ", ".join(map(str, changes))
        raise SweepError(
            f"with {what}: {first.message}", where=first.where, remedy=first.remedy
        ) from error
    # Of thousands of variants most parts are those of the file, and are one object. Compared, for
    # what the record makes of a changed part is another.
    names = made.model_fields_set - {change.path[0] for change in changes}
    parts = {name: getattr(spec, name) for name in names}
    return made.model_copy(
        update={name: part for name, part in parts.items() if part == getattr(made, name)}
    )
