"""Strict YAML 1.2 documents with the line and column of every value.

The core schema of YAML 1.2 only: ``no`` and ``on`` are text, dates are text, and so is ``017``,
which 1.1 and 1.2 read as different numbers. Duplicate keys, explicit tags, numbers that are not
decimal or not finite, merge keys, recursive aliases and oversized documents are errors, all but the
numbers found on the event stream before anything is built.
"""

from __future__ import annotations

import hashlib
import math
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, reduce, wraps
from operator import getitem
from pathlib import Path
from typing import Any, Final, Protocol, TypeVar

import yaml
from pydantic import BaseModel, ValidationError, model_validator
from pydantic.errors import PydanticInvalidForJsonSchema
from pydantic_core import InitErrorDetails, PydanticCustomError

from adeye.errors import InputError, InputErrors, SourceLocation, SpecError, suggest
from adeye.outputs import require_plain
from adeye.spec.expression import parse
from adeye.spec.quantity import PATTERNS
from adeye.units import format_quantity, shown

# --- What pydantic finds wrong with a document, as errors with file, line and column --------------

MAX_LISTED: Final = 100
"""Most problems of one document that are listed; the rest is counted."""

Loc = tuple[str | int, ...]
Problem = tuple[Loc, str]
"""Where a part of a record is, and what is wrong with it."""
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
        if not has_part(value, part):
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
    if kind in _LIMITS and isinstance(written := reduce(getitem, loc, document.value), str):
        # A quantity is compared in SI; it is told as it is written.
        item = {**item, "input": written}
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
        or re.search(rf"(?<![\w.]){re.escape(repr(value))}(?![\w.]*\w)", message)
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
        if has_part(value, part):
            value = value[part]
            real.append(part)
        elif beyond and number == len(loc) - 1:
            real.append(part)
    return tuple(real)


def has_part(value: Any, part: str | int) -> bool:
    """Return whether a mapping or list has an item under a key or number."""
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
    for option in (*schema.get("anyOf", []), *schema.get("oneOf", [])):
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


# --- Strict YAML 1.2 documents with the line and column of every value ----------------------------

MAX_BYTES: Final = 1_000_000
MAX_NODES: Final = 100_000
MAX_DEPTH: Final = 50

_INTEGER: Final = re.compile(r"[-+]?(?:0|[1-9][0-9]*)")
_OTHER_BASE: Final = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT: Final = re.compile(r"[-+]?(?:\.[0-9]+|(?:0|[1-9][0-9]*)(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_NON_FINITE: Final = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
# What is not among the printable characters of YAML 1.2.2, production [1].
_FOREIGN: Final = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_WORDS: Final = {
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys(("null", "Null", "NULL", "~", ""), None),
}
_Loader: Final = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(frozen=True)
class Document:
    """A YAML file as plain data, with places.

    Attributes:
        path: As given by the user.
        value: Plain Python data.
        digest: sha256 of the file as it was read, in hex; empty of a text that is in none.
    """

    path: str
    value: Any
    _values: Mapping[Loc, SourceLocation]
    _keys: Mapping[Loc, SourceLocation]
    digest: str = ""

    def locate(self, loc: Loc) -> SourceLocation:
        """Find the place of a part, or of the deepest part above it that exists."""
        return _nearest(self._values, loc)

    def locate_key(self, loc: Loc) -> SourceLocation:
        """Find the place of the key of a part."""
        return self._keys.get(loc) or _nearest(self._values, loc)

    def heir(self, loc: Loc) -> str:  # noqa: ARG002 - nothing is inherited
        """Return no file: everything is written here."""
        return ""


def load_document(path: str | Path) -> Document:
    """Read a YAML file.

    Raises:
        SpecError: The file is missing, too large, no strict YAML, or empty.
    """
    text = _read(Path(path))
    digest = hashlib.sha256(text.encode()).hexdigest()
    return replace(parse_document(text, str(path)), digest=digest)


def parse_document(text: str, path: str) -> Document:
    """Read YAML text that stands for a file.

    Raises:
        SpecError: It is no strict YAML, too large, or empty.
    """
    start = SourceLocation(path, 1, 1)
    _check_characters(text, path)
    if len(text.encode()) > MAX_BYTES:
        text = f"the file has more than {MAX_BYTES:,} bytes"
        raise SpecError(text, where=start, remedy="Split it.")
    try:
        _Scan(path).run(text)
        node = yaml.compose(text, Loader=_Loader)
    except yaml.YAMLError as error:
        raise _yaml_error(error, text, path) from error
    if node is None:
        raise SpecError("the document is empty", where=start, remedy="Write a mapping.")
    builder = _Builder(path)
    value = builder.build(node, ())
    return Document(path, value, builder.values, builder.keys)


def _read(path: Path) -> str:
    where = SourceLocation(str(path), 0, 0)
    try:
        require_plain(path, MAX_BYTES)
        with path.open("rb") as file:
            content = file.read(MAX_BYTES)
    except FileNotFoundError as error:
        raise SpecError("there is no such file", where=where, remedy="Check the path.") from error
    except OSError as error:
        raise SpecError(f"the file cannot be read: {error.strerror}", where=where) from error
    except ValueError as error:
        raise SpecError(f"{shown(str(path))} is not a path", where=None) from error
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise SpecError(
            f"byte 0x{content[error.start]:02x} is not UTF-8",
            where=_after(content[: error.start].decode("utf-8"), str(path)),
            remedy="Save the file as UTF-8.",
        ) from error


def _check_characters(text: str, path: str) -> None:
    foreign = _FOREIGN.search(text)
    if foreign is not None:
        raise SpecError(
            f"character U+{ord(foreign[0]):04X} cannot stand in YAML",
            where=_after(text[: foreign.start()], path),
            remedy="Remove it.",
        )


def _after(before: str, path: str) -> SourceLocation:
    line_start = before.rfind("\n") + 1
    return SourceLocation(path, before.count("\n") + 1, len(before) - line_start + 1)


class _Scan:
    """Looks for what must not be built, with aliases counted at the size of what they repeat."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._documents = 0
        self._nodes = 0
        self._sizes: dict[str, int] = {}
        # For each open collection: its anchor and the nodes before it.
        self._open: list[tuple[str | None, int]] = []

    def run(self, text: str) -> None:
        for event in yaml.parse(text, Loader=_Loader):
            if isinstance(event, yaml.NodeEvent):
                self._node(event)
            elif isinstance(event, yaml.CollectionEndEvent):
                anchor, before = self._open.pop()
                if anchor is not None:
                    self._sizes[anchor] = self._nodes - before
            elif isinstance(event, yaml.DocumentStartEvent):
                self._document(event)

    def _document(self, event: yaml.DocumentStartEvent) -> None:
        self._documents += 1
        if self._documents > 1:
            raise self._error("a second document begins here", event, "Keep one.")
        if event.version not in {None, (1, 2)}:
            raise self._error(
                "this is YAML 1.1, whose words and numbers mean other things",
                event,
                "Remove %YAML and check words like no, on and 017.",
            )

    def _node(self, event: yaml.NodeEvent) -> None:
        if isinstance(event, yaml.AliasEvent):
            if any(anchor == event.anchor for anchor, _ in self._open):
                raise self._error(f"alias *{event.anchor} contains itself", event)
            self._nodes += self._sizes.get(str(event.anchor), 1)
        else:
            self._value(event)
        if self._nodes > MAX_NODES:
            raise self._error(f"more than {MAX_NODES:,} values, aliases included", event)

    def _value(self, event: Any) -> None:
        if event.tag is not None:
            raise self._error(
                f"tag {shown(event.tag)} is not read", event, "Remove it; quote text that needs it."
            )
        if isinstance(event, yaml.CollectionStartEvent):
            self._open.append((event.anchor, self._nodes))
            if len(self._open) > MAX_DEPTH:
                raise self._error(f"nested more than {MAX_DEPTH} deep", event)
        elif event.anchor is not None:
            self._sizes[event.anchor] = 1
        self._nodes += 1

    def _error(self, what: str, event: yaml.Event, remedy: str = "") -> SpecError:
        return SpecError(what, where=_mark(event.start_mark, self._path), remedy=remedy)


class _Builder:
    """Builds plain data from composed nodes and notes every place."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.values: dict[Loc, SourceLocation] = {}
        self.keys: dict[Loc, SourceLocation] = {}

    def build(self, node: yaml.Node, loc: Loc) -> Any:
        self.values[loc] = _mark(node.start_mark, self.path)
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, loc)
        if isinstance(node, yaml.SequenceNode):
            return [self.build(item, (*loc, k)) for k, item in enumerate(node.value)]
        if isinstance(node, yaml.ScalarNode) and not node.style:
            return self._plain(node.value, self.values[loc])
        return node.value

    def _mapping(self, node: yaml.MappingNode, loc: Loc) -> dict[str, Any]:
        built: dict[str, Any] = {}
        written: dict[str, SourceLocation] = {}
        for key_node, value_node in node.value:
            place = _mark(key_node.start_mark, self.path)
            key = self._key(key_node, place)
            # Two spellings of one accented letter are one key for the reader.
            name = unicodedata.normalize("NFC", key)
            if name in written:
                raise SpecError(
                    f"key {shown(key)} occurs twice, first in line {written[name].line}",
                    where=place,
                    remedy="Remove one.",
                )
            written[name] = place
            self.keys[(*loc, key)] = place
            built[key] = self.build(value_node, (*loc, key))
        return built

    def _key(self, node: yaml.Node, place: SourceLocation) -> str:
        if not isinstance(node, yaml.ScalarNode):
            raise SpecError("a key must be text", where=place)
        if node.value == "<<" and not node.style:
            raise SpecError(
                "merge keys are not read", where=place, remedy="Use `extends:` or repeat it."
            )
        return str(node.value)

    def _plain(self, text: str, where: SourceLocation) -> Any:
        if text in _WORDS:
            return _WORDS[text]
        if _NON_FINITE.fullmatch(text):
            raise SpecError(f"{text} is not a finite number", where=where, remedy="Write a number.")
        if _OTHER_BASE.fullmatch(text):
            raise SpecError(
                f"{shown(text)} is not a decimal number",
                where=where,
                remedy="Write it with the digits 0 to 9, or quote it if it is text.",
            )
        if _INTEGER.fullmatch(text):
            return _integer(text, where)
        if _FLOAT.fullmatch(text):
            value = float(text)
            if not math.isfinite(value):
                raise SpecError(f"{shown(text)} is not a finite number", where=where)
            return value
        return text


def _integer(text: str, where: SourceLocation) -> int:
    # 80 characters are enough for 64 bits; Python refuses thousands of digits with an exception.
    value = int(text) if len(text) <= 80 else None
    if value is None or not -(2**63) <= value < 2**64:
        raise SpecError(
            f"{shown(text)} does not fit into 64 bits", where=where, remedy="Write 1e20 for 10^20."
        )
    return value


def _mark(mark: Any, path: str) -> SourceLocation:
    return SourceLocation(path, mark.line + 1, mark.column + 1)


def _nearest(places: Mapping[Loc, SourceLocation], loc: Loc) -> SourceLocation:
    while loc and loc not in places:
        loc = loc[:-1]
    return places[loc]


def _yaml_error(error: yaml.YAMLError, text: str, path: str) -> SpecError:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    # What is missing at the end is reported in the line after the last.
    is_inside = mark is not None and mark.line <= text.count("\n")
    where = _mark(mark, path) if is_inside else _after(text, path)
    problem = getattr(error, "problem", None) or str(error).splitlines()[0]
    return SpecError(f"no valid YAML: {problem}", where=where)


# --- Say where inside a record a reference or value is wrong, so that its line can be shown -------


def misplaced(found: Sequence[Problem]) -> ValidationError:
    """Make the error that a record's validator raises about some of its parts.

    Args:
        found: For each problem its location below the record and what is wrong, with what is
            allowed.

    Returns:
        To be raised inside a validator; the validation of the whole takes over the locations.
    """
    details: list[InitErrorDetails] = [
        InitErrorDetails(
            type=PydanticCustomError("misplaced", "{text}", {"text": text}), loc=loc, input=None
        )
        for loc, text in found
    ]
    return ValidationError.from_exception_data("record", details)


def finds(check: Callable[[Any], Iterable[Problem]]) -> Any:
    """Make the validator of a record from a method that lists what is wrong with its parts.

    Args:
        check: Gives location within the record and message of each; see ``misplaced``.
    """

    @wraps(check)
    def validated(record: Any) -> Any:
        if found := list(check(record)):
            raise misplaced(found)
        return record

    return model_validator(mode="after")(validated)


def repeated(names: Sequence[str]) -> list[int]:
    """List the positions at which a name occurs that was there before.

    >>> repeated(["a", "b", "a"])
    [2]
    """
    seen: dict[Any, int] = {}
    return [at for at, name in enumerate(names) if seen.setdefault(name, at) != at]
