"""What pydantic finds wrong with a document, as errors with file, line and column."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic.errors import PydanticInvalidForJsonSchema

from adeye.errors import InputError, InputErrors, SourceLocation, SpecError, suggest
from adeye.spec.expression import parse
from adeye.spec.quantity import PATTERNS
from adeye.units import format_quantity, shown

if TYPE_CHECKING:
    from collections.abc import Iterator

MAX_LISTED: Final = 100
"""Most problems of one document that are listed; the rest is counted."""

Loc = tuple[str | int, ...]
Model = TypeVar("Model", bound=BaseModel)

_KEY: Final = "[key]"
_MAPPING: Final = "must be a mapping, like {key: value}"
_LIST: Final = "must be a list, like [a, b]"
_WANTED: Final = {
    "bool_type": "must be true or false",
    "dict_type": _MAPPING,
    "float_type": "must be a number",
    "quantity_type": "must be a quantity, like 60 km/h, or a number",
    "int_from_float": "must be a whole number",
    "int_type": "must be a whole number",
    "list_type": _LIST,
    "model_type": _MAPPING,
    "string_type": "must be text",
    "tuple_type": _LIST,
}
_SCALARS: Final = {"string_type", "int_type", "float_type"}
_LIMITS: Final = {
    "greater_than": ("more than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}
_OF_ANOTHER_KIND: Final = frozenset(
    {
        "literal_error",
        "missing",
        "string_pattern_mismatch",
        "union_tag_invalid",
        "union_tag_not_found",
    }
)


class Located(Protocol):
    """Something with a value whose parts have places."""

    @property
    def value(self) -> Any:
        """Plain Python data."""
        ...

    def locate(self, loc: Loc) -> SourceLocation:
        """Find the place of a part."""
        ...

    def locate_key(self, loc: Loc) -> SourceLocation:
        """Find the place of the key of a part."""
        ...

    def heir(self, loc: Loc) -> str:
        """Name the file that inherits a part; empty if it is written where it is read."""
        ...


def validate(document: Located, model: type[Model]) -> Model:
    """Validate a document against a spec model.

    Raises:
        SpecError: One problem, with its place.
        InputErrors: Several problems in the order of the lines, each with its place.
    """
    try:
        return model.model_validate(document.value)
    except ValidationError as error:
        items = _of_best_members(document.value, _without_echoes(error.errors(include_url=False)))
        problems = [_problem(document, item, model) for item in items[:MAX_LISTED]]
        unique = sorted({str(problem): problem for problem in problems}.values(), key=_order)
        if len(unique) == 1 and len(items) <= MAX_LISTED:
            raise unique[0] from error
        unlisted = max(0, len(items) - MAX_LISTED)
        raise InputErrors(unique, unlisted=unlisted) from error


def _without_echoes(items: list[Any]) -> list[Any]:
    """Drop what only repeats another problem.

    A list whose only members are not valid is not also empty, and what is neither text nor one of
    the kinds of number is no quantity.
    """
    kinds: dict[Loc, set[str]] = {}
    for item in items:
        kinds.setdefault(item["loc"][:-1], set()).add(item["type"])
    joined: list[Any] = []
    for item in items:
        if kinds[item["loc"][:-1]] != _SCALARS:
            joined.append(item)
        elif item["type"] == "string_type":
            joined.append({**item, "type": "quantity_type", "loc": item["loc"][:-1]})
    items = joined
    above = {item["loc"][:depth] for item in items for depth in range(len(item["loc"]))}
    return [item for item in items if item["type"] != "too_short" or item["loc"] not in above]


def _of_best_members(value: Any, items: list[Any]) -> list[Any]:
    """Keep, where a value fits no member of a union, the problems of the nearest member only."""
    members: dict[Loc, dict[str | int, list[Any]]] = {}
    placed = [(_union(value, item), item) for item in items]
    for union, item in placed:
        if union is not None:
            members.setdefault(union[:-1], {}).setdefault(union[-1], []).append(item)
    best = {
        at: min(found, key=lambda member: _distance(len(at), found[member]))
        for at, found in members.items()
    }
    return [item for union, item in placed if union is None or best[union[:-1]] == union[-1]]


def _union(value: Any, item: Any) -> Loc | None:
    """Return the real place of the first union in a problem's location and the member's name."""
    loc = item["loc"][:-1] if _ends_in_key(item) else item["loc"]
    for number, part in enumerate(loc):
        if not _has(value, part):
            return (*loc[:number], part)
        value = value[part]
    return None


def _ends_in_key(item: Any) -> bool:
    return item["type"] in {"missing", "extra_forbidden"} or item["loc"][-1:] == (_KEY,)


def _distance(depth: int, items: list[Any]) -> tuple[int, int]:
    """Rank a union's member: of another type, of another kind, or how many problems it has."""
    rank = 0
    for item in items:
        below = len([part for part in item["loc"][depth:] if part != _KEY])
        if below <= 1 and item["type"].endswith("_type"):
            rank = 2
        elif item["type"] in _OF_ANOTHER_KIND:
            rank = max(rank, 1)
    return rank, len(items)


def _order(problem: InputError) -> tuple[str, int, int]:
    where = problem.where or SourceLocation("", 0, 0)
    return where.path, where.line, where.column


def _problem(document: Located, item: Any, model: type[BaseModel]) -> InputError:
    kind = item["type"]
    loc = _real(document.value, item["loc"], beyond=kind in {"missing", "extra_forbidden"})
    name = _name(loc) or model.__name__
    if kind == "extra_forbidden":
        return _unknown_key(document, loc, name, _allowed_keys(model, item["loc"][:-1]))
    if kind == "missing":
        return SpecError(
            f"{name} is missing", where=document.locate(loc[:-1]), remedy=f"Add `{loc[-1]}:`."
        )
    if item["loc"] and item["loc"][-1] == _KEY:
        return SpecError(
            f"{name}: {_worded(item)} (key {shown(item['input'])})",
            where=document.locate_key(loc),
        )
    if kind in {"union_tag_invalid", "union_tag_not_found"}:
        return _tag(document, loc, name, item["ctx"])
    remedy = ""
    if kind in {"literal_error", "enum"} and isinstance(item["input"], str):
        remedy = _near(item["input"], item["ctx"]["expected"])
    return SpecError(f"{name}: {_said(item)}", where=document.locate(loc), remedy=remedy)


def _name(loc: Loc) -> str:
    """Join the parts of a location; keys come from the user and may hold anything."""
    parts = map(str, loc)
    return ".".join(
        part if part.isprintable() and len(part) <= 80 else shown(part) for part in parts
    )


def _unknown_key(document: Located, loc: Loc, name: str, allowed: list[str]) -> InputError:
    near = suggest(str(loc[-1]), allowed) if allowed else "Remove it."
    # The nearest word is a guess, so the others follow it.
    if near.startswith("Did"):
        near += f" Allowed: {', '.join(allowed)}."
    heir = document.heir(loc)
    if heir:
        near += f" It is inherited: `{loc[-1]}: null` at this place in {heir} removes it."
    return SpecError(
        f"{name}: there is no key {shown(loc[-1])} here",
        where=document.locate_key(loc),
        remedy=near,
    )


def _tag(document: Located, loc: Loc, name: str, context: Mapping[str, Any]) -> InputError:
    """Say which values the key that chooses a record's kind may have."""
    key = str(context["discriminator"]).strip("'")
    expected = str(context.get("expected_tags", ""))
    if not expected:
        return SpecError(
            f"{name}.{key} is missing", where=document.locate(loc), remedy=f"Add `{key}:`."
        )
    tag = str(context["tag"])
    return SpecError(
        f"{name}.{key}: {shown(tag)} is not one of {expected}",
        where=document.locate((*loc, key)),
        remedy=_near(tag, expected),
    )


def _near(word: str, expected: str) -> str:
    near = suggest(word, re.findall(r"'([^']*)'", expected))
    return near if near.startswith("Did") else ""


def _said(item: Mapping[str, Any]) -> str:
    """Repeat a validator's message, with the offending value if it is not in there."""
    message = _worded(item)
    value = item["input"]
    if (
        item["type"] == "misplaced"
        or isinstance(value, Mapping | list | tuple)
        or repr(value) in message
    ):
        return message
    return f"{message.rstrip('.')} ({shown(value)})"


def _worded(item: Mapping[str, Any]) -> str:
    """Say what a validator wants in the words of YAML and in the user's units."""
    kind, context = item["type"], item.get("ctx", {})
    if kind in _WANTED:
        return _WANTED[kind]
    if kind in {"too_short", "too_long"}:
        word, key = ("least", "min_length") if kind == "too_short" else ("most", "max_length")
        return f"the list has {context['actual_length']} of at {word} {context[key]} items"
    if kind in _LIMITS:
        word, key = _LIMITS[kind]
        return f"must be {word} {_in_units_of(item['input'], float(context[key]))}"
    if kind == "string_pattern_mismatch" and context["pattern"] in PATTERNS:
        return PATTERNS[context["pattern"]]
    if kind.startswith("date_"):
        return "must be a date, like 2027-12-31"
    return _inner(item["msg"]).replace("Input should be", "must be", 1)


def _in_units_of(value: Any, limit: float) -> str:
    """Write a limit in SI as the value is written."""
    if isinstance(value, str):
        try:
            dimension = parse(value).dimension({})
        except InputError:
            dimension = None
        if dimension is not None:
            return format_quantity(limit, dimension)
    return f"{limit:g}"


def _inner(message: str) -> str:
    """Drop the class names that pydantic and an error inside a validator put before a message."""
    return re.sub(r"^(?:[A-Z][A-Za-z]*Error: )", "", message.removeprefix("Value error, "))


def _real(value: Any, loc: Loc, *, beyond: bool) -> Loc:
    """Drop the parts of a validator's location that name union members, not keys.

    Args:
        value: The document.
        loc: The validator's location.
        beyond: Whether the last part is a key that need not be there.
    """
    real: list[str | int] = []
    for number, part in enumerate(loc):
        if _has(value, part):
            value = value[part]
            real.append(part)
        elif beyond and number == len(loc) - 1:
            real.append(part)
    return tuple(real)


def _has(value: Any, part: str | int) -> bool:
    if isinstance(value, Mapping):
        return part in value
    return isinstance(value, list) and isinstance(part, int) and part < len(value)


@lru_cache(maxsize=32)
def _schema(model: type[BaseModel]) -> Mapping[str, Any]:
    try:
        return model.model_json_schema(by_alias=True)
    except PydanticInvalidForJsonSchema:
        # A model of a plug-in need not have one; only the list of allowed keys is lost.
        return {}


def _allowed_keys(model: type[BaseModel], loc: Loc) -> list[str]:
    """List the keys of the record at a place, following the model's schema."""
    schema = _schema(model)
    definitions = schema.get("$defs", {})
    current: list[Any] = [schema]
    for part in loc:
        current = [found for item in current for found in _step(item, part, definitions)]
    keys: dict[str, None] = {}
    for item in current:
        for candidate in _expand(item, definitions):
            keys |= dict.fromkeys(candidate.get("properties", {}))
    return list(keys)


def _step(schema: Any, part: str | int, definitions: Mapping[str, Any]) -> Iterator[Any]:
    member = _member(schema, part, definitions)
    if member is not None:
        yield member
        return
    found = [
        inner for candidate in _expand(schema, definitions) for inner in _inside(candidate, part)
    ]
    # A part that leads nowhere names a union, not a key.
    yield from found or [schema]


def _inside(candidate: Mapping[str, Any], part: str | int) -> Iterator[Any]:
    if isinstance(part, int):
        if "items" in candidate:
            yield candidate["items"]
    elif part in candidate.get("properties", {}):
        yield candidate["properties"][part]
    elif isinstance(candidate.get("additionalProperties"), dict):
        yield candidate["additionalProperties"]
    else:
        yield from candidate.get("patternProperties", {}).values()


def _member(schema: Any, part: str | int, definitions: Mapping[str, Any]) -> Any:
    """Return the member of a union that a part of a validator's location names, or None."""
    if not isinstance(schema, dict):
        return None
    name = schema.get("$ref", "").rsplit("/", 1)[-1]
    if name:
        return _member(definitions.get(name, {}), part, definitions)
    chosen = schema.get("discriminator", {}).get("mapping", {}).get(part)
    if chosen is not None:
        # A member that is a union itself stands there whole.
        return chosen if isinstance(chosen, dict) else {"$ref": chosen}
    for option in schema.get("anyOf", []):
        if part in {option.get("title"), option.get("$ref", "").rsplit("/", 1)[-1]}:
            return option
        found = _member(option, part, definitions)
        if found is not None:
            return found
    return None


def _expand(schema: Any, definitions: Mapping[str, Any]) -> Iterator[Any]:
    if not isinstance(schema, dict):
        return
    if "$ref" in schema:
        yield from _expand(definitions.get(schema["$ref"].rsplit("/", 1)[-1], {}), definitions)
        return
    options = [*schema.get("anyOf", []), *schema.get("oneOf", [])]
    if not options:
        yield schema
    for option in options:
        yield from _expand(option, definitions)
