"""Bounds of what is plausible: generous, named, and lifted by a file that says so.

They catch slips of units and digits, and say nothing about what is good. The first bound whose
pattern is the end of a quantity's dotted path counts, else that of its dimension.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from fnmatch import fnmatchcase
from functools import cache, lru_cache
from typing import Annotated, Any, ClassVar, Final, NamedTuple, get_args, get_origin

import numpy as np
from pydantic import AfterValidator, BaseModel

from adeye.errors import UnitError, suggest
from adeye.kernel.relation import differences
from adeye.packaged import packaged_yaml
from adeye.spec.document import Loc
from adeye.spec.expression import Expression
from adeye.spec.quantity import GrownRecord, Many
from adeye.units import Dimension, format_quantity, parse_quantity, shown

Limits = Mapping[str, tuple[Any, Any]]
"""Least and most in SI by the name of a bound, of one run or as columns over runs."""


BOUNDS: Final[dict[str, tuple[str, str, str]]] = packaged_yaml("adeye.spec", "bounds.yaml")
"""Least and most, and the ends of the dotted paths that it is of, ``*`` for an id; without ends it
is of whatever has the dimension otherwise. Our choice: what no road vehicle, sensor, road or
weather is beyond, with room to spare. Some are narrower where more is known:
``FileRecord.own_limits``.
"""


_FAR: Final = 1e6
"""Beyond it in SI nothing about a drive is: 11 days, 1,000 km."""


def _known(name: str) -> str:
    if name not in BOUNDS:
        msg = f"there is no bound of plausibility {shown(name)}. {suggest(name, BOUNDS)}"
        raise ValueError(msg)
    return name


class FileRecord(GrownRecord):
    """Base of what a file holds; it may say that it means what is beyond the plausible."""

    later: ClassVar[tuple[str, ...]] = ("beyond_plausible",)

    beyond_plausible: Many[Annotated[str, AfterValidator(_known)]] = ()
    """Bounds of plausibility that are lifted for what this file says."""

    def own_limits(self) -> Limits:
        """Return what is narrower than the table because of other values of the file."""
        return {}


class Implausible(NamedTuple):
    """A quantity beyond its bound.

    Attributes:
        loc: Its place below the file.
        text: What is wrong, and what is allowed.
        remedy: What to do.
    """

    loc: Loc
    text: str
    remedy: str


def implausible(
    record: BaseModel,
    lifted: Collection[str] = (),
    limits: Limits | None = None,
    value_of: Callable[[Expression], Any] | None = None,
    loc: Loc = (),
) -> Iterator[Implausible]:
    """Find what is beyond the plausible.

    Args:
        record: What a file holds, or a part of it.
        lifted: Names of bounds that do not count.
        limits: What is narrower than the table.
        value_of: Evaluates a formula; then nothing else is looked at, but for what has limits.
            Without it only what is constant is.
        loc: Place of the record in its file.
    """
    limits = limits or {}
    for place, value, dimension in quantities(record, loc):
        name = _bound_of(".".join(part for part in place if isinstance(part, str)), dimension)
        if name in {"", *lifted}:
            continue
        if isinstance(value, Expression):
            is_wanted = value.is_constant is (value_of is None) or (value_of and name in limits)
            if value.is_truth or not is_wanted:
                continue
            value = value_of(value) if value_of else value.evaluate({})  # noqa: PLW2901
        elif value_of:
            continue
        low, high = limits.get(name) or _in_si(name, dimension)
        if value_of is None and low <= value <= high:
            continue
        values, low, high = np.broadcast_arrays(value, low, high)
        beyond = np.flatnonzero(
            (differences(values, low) < 0.0) | (differences(values, high) > 0.0)
        )
        if len(beyond):
            first = beyond[0]
            found, least, most = (
                format_quantity(float(column.flat[first]), dimension)
                for column in (values, low, high)
            )
            path = ".".join(map(str, place))
            yield Implausible(
                place,
                f"{path}: {found} is not plausible; {name} is from {least} to {most}",
                f"Correct it, or write `beyond_plausible: [{name}]` at the top of the file that "
                "says so, if it is meant.",
            )


@lru_cache(maxsize=4096)
def _bound_of(path: str, dimension: Dimension) -> str:
    """Name the bound of a quantity; empty for a plain number that has none."""
    for name, (_, _, ends) in BOUNDS.items():
        if any(fnmatchcase(f".{path}", f"*.{end}") for end in ends.split()):
            # A fault's ``value`` may be a grip or what a sensor measures.
            with suppress(UnitError):
                _in_si(name, dimension)
                return name
    name = dimension.name.lower()
    return name if name in BOUNDS else ""


@lru_cache(maxsize=512)
def _in_si(name: str, dimension: Dimension) -> tuple[float, float]:
    low, high, _ = BOUNDS[name]
    return parse_quantity(low, dimension), parse_quantity(high, dimension)


@cache
def farthest(exponents: tuple[int, int, int]) -> float:
    """Return the magnitude beyond which nothing that has a dimension is plausible.

    Args:
        exponents: Of length, time and angle.

    Returns:
        In SI; without a bound of the dimension what nothing about a drive reaches, whatever it is.
    """
    bound = (item for item in Dimension if item.exponents == exponents and _bound_of("", item))
    dimension = next(bound, None)
    if dimension is None:
        return _FAR
    return max(map(abs, _in_si(dimension.name.lower(), dimension)))


def quantities(record: Any, loc: Loc) -> Iterator[tuple[Loc, Any, Dimension]]:
    """Walk to every quantity and formula of a record with the dimension that its field asks for.

    Args:
        record: A spec record, or a mapping or tuple of such.
        loc: Its place.

    Yields:
        Place, value in SI or expression, and dimension; conditions have none.
    """
    if isinstance(record, BaseModel):
        # Where another value decides what a quantity is of.
        own: Mapping[str, Dimension] = getattr(record, "own_dimensions", dict)()
        for name, required in {**_dimensions(type(record)), **own}.items():
            for place, item in _leaves(getattr(record, name), (*loc, name)):
                if isinstance(item, Expression) or (required and isinstance(item, float)):
                    yield place, item, required or Dimension.NONE
                elif isinstance(item, BaseModel):
                    yield from quantities(item, place)


@lru_cache(maxsize=512)
def _dimensions(model: type[BaseModel]) -> dict[str, Dimension | None]:
    found = {
        name: _dimension(field.metadata) or _required(field.annotation)
        for name, field in model.model_fields.items()
    }
    return {
        name: dimension
        for name, dimension in found.items()
        if dimension or not _is_plain(model.model_fields[name].annotation)
    }


def _is_plain(annotation: Any) -> bool:
    """Tell whether a type holds bare numbers and texts only, such as the line of a road."""
    parts = get_args(annotation)
    if get_origin(annotation) is Annotated:
        parts = parts[:1]
    return all(map(_is_plain, parts)) if parts else annotation in _PLAIN


_PLAIN: Final = (float, int, str, bool, type(None), ...)


def _leaves(value: Any, loc: Loc) -> Iterator[tuple[Loc, Any]]:
    if isinstance(value, Mapping | tuple):
        items = value.items() if isinstance(value, Mapping) else enumerate(value)
        for name, item in items:
            yield from _leaves(item, (*loc, name))
    else:
        yield loc, value


def _required(annotation: Any) -> Dimension | None:
    """Find the dimension in the metadata of a type; conditions have none."""
    parts = get_args(annotation)
    if get_origin(annotation) is Annotated:
        return _dimension(parts[1:]) or _required(parts[0])
    found = (_required(part) for part in parts)
    return next((dimension for dimension in found if dimension is not None), None)


def _dimension(metadata: Iterable[Any]) -> Dimension | None:
    found = (getattr(item, "dimension", None) for item in metadata)
    return next((item for item in found if isinstance(item, Dimension)), None)
