"""Strict YAML 1.2 documents with the line and column of every value.

The core schema of YAML 1.2 only: ``no`` and ``on`` are text, ``017`` is text, dates are text.
Duplicate keys, non-finite numbers, merge keys, recursive aliases and oversized documents are
errors, found on the event stream before anything is built.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from adeye.errors import InputError, InputErrors, SourceLocation, SpecError, suggest

MAX_BYTES: Final = 1_000_000
MAX_NODES: Final = 100_000
MAX_DEPTH: Final = 50

_INTEGER: Final = re.compile(r"^[-+]?(0|[1-9][0-9]*)$")
_FLOAT: Final = re.compile(r"^[-+]?(\.[0-9]+|(0|[1-9][0-9]*)(\.[0-9]*)?)([eE][-+]?[0-9]+)?$")
_NON_FINITE: Final = re.compile(r"^([-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN))$")
_WORDS: Final = {
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys(("null", "Null", "NULL", "~", ""), None),
}
_Loader: Final = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

Loc = tuple[str | int, ...]
Model = TypeVar("Model", bound=BaseModel)


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


@dataclass(frozen=True)
class Document:
    """A YAML file as plain data, with places.

    Attributes:
        path: As given by the user.
        value: Plain Python data.
    """

    path: str
    value: Any
    _values: Mapping[Loc, SourceLocation]
    _keys: Mapping[Loc, SourceLocation]

    def locate(self, loc: Loc) -> SourceLocation:
        """Find the place of a part, or of the deepest part above it that exists."""
        return _nearest(self._values, loc)

    def locate_key(self, loc: Loc) -> SourceLocation:
        """Find the place of the key of a part."""
        return self._keys.get(loc) or _nearest(self._values, loc)


def load_document(path: str | Path) -> Document:
    """Read a YAML file.

    Raises:
        SpecError: The file is missing, too large, no strict YAML, or empty.
    """
    text = _read(Path(path))
    return parse_document(text, str(path))


def parse_document(text: str, path: str) -> Document:
    """Read YAML text that stands for a file.

    Raises:
        SpecError: It is no strict YAML, too large, or empty.
    """
    start = SourceLocation(path, 1, 1)
    try:
        _scan(text, path)
        node = yaml.compose(text, Loader=_Loader)
    except yaml.YAMLError as error:
        raise _yaml_error(error, path) from error
    except (RecursionError, ValueError) as error:
        raise SpecError("the document cannot be read", where=start) from error
    if node is None:
        raise SpecError("the document is empty", where=start, remedy="Write a mapping.")
    builder = _Builder(path)
    value = builder.build(node, ())
    return Document(path, value, builder.values, builder.keys)


def validate(document: Located, model: type[Model]) -> Model:
    """Validate a document against a spec model.

    Raises:
        SpecError: One problem, with its place.
        InputErrors: Several problems, each with its place.
    """
    try:
        return model.model_validate(document.value)
    except ValidationError as error:
        problems = [_problem(document, item, model) for item in error.errors()]
        unique = list({str(problem): problem for problem in problems}.values())
        if len(unique) == 1:
            raise unique[0] from error
        raise InputErrors(unique) from error


def _read(path: Path) -> str:
    where = SourceLocation(str(path), 1, 1)
    try:
        if path.is_dir():
            raise SpecError("this is a folder, not a file", where=where, remedy="Name a file.")
        if path.stat().st_size > MAX_BYTES:
            raise SpecError(
                f"the file has {path.stat().st_size:,} bytes, at most {MAX_BYTES:,} are read",
                where=where,
            )
        return path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise SpecError("there is no such file", where=where, remedy="Check the path.") from error
    except UnicodeDecodeError as error:
        raise SpecError("the file is not UTF-8", where=where, remedy="Save it as UTF-8.") from error
    except OSError as error:
        raise SpecError(f"the file cannot be read: {error.strerror}", where=where) from error


def _scan(text: str, path: str) -> None:
    """Count nodes and depth, aliases at the size of what they repeat, before building anything."""
    sizes: dict[str, int] = {}
    open_anchors: list[str | None] = []
    counts: list[int] = [0]
    documents = 0
    for event in yaml.parse(text, Loader=_Loader):
        place = _mark(event.start_mark, path)
        if isinstance(event, yaml.DocumentStartEvent):
            documents += 1
            if documents > 1:
                raise SpecError("a second document begins here", where=place, remedy="Keep one.")
        elif isinstance(event, yaml.AliasEvent):
            if event.anchor in open_anchors:
                raise SpecError(f"alias *{event.anchor} contains itself", where=place)
            counts[-1] += sizes.get(event.anchor, 1)
        elif isinstance(event, yaml.CollectionStartEvent):
            open_anchors.append(event.anchor)
            counts.append(1)
            if len(counts) > MAX_DEPTH + 1:
                raise SpecError(f"nested more than {MAX_DEPTH} deep", where=place)
        elif isinstance(event, yaml.CollectionEndEvent):
            size, anchor = counts.pop(), open_anchors.pop()
            if anchor is not None:
                sizes[anchor] = size
            counts[-1] += size
        elif isinstance(event, yaml.ScalarEvent):
            if event.anchor is not None:
                sizes[event.anchor] = 1
            counts[-1] += 1
        if sum(counts) > MAX_NODES:
            raise SpecError(f"more than {MAX_NODES:,} values, aliases included", where=place)


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
        assert isinstance(node, yaml.ScalarNode)
        return self._scalar(node, loc)

    def _mapping(self, node: yaml.MappingNode, loc: Loc) -> dict[str, Any]:
        built: dict[str, Any] = {}
        for key_node, value_node in node.value:
            place = _mark(key_node.start_mark, self.path)
            if not isinstance(key_node, yaml.ScalarNode):
                raise SpecError("a key must be text", where=place)
            key = key_node.value
            if key == "<<" and not key_node.style:
                raise SpecError(
                    "merge keys are not read", where=place, remedy="Use `extends:` or repeat it."
                )
            if key in built:
                first = self.keys[(*loc, key)]
                raise SpecError(
                    f"key {key!r} occurs twice, first in line {first.line}",
                    where=place,
                    remedy="Remove one.",
                )
            self.keys[(*loc, key)] = place
            built[key] = self.build(value_node, (*loc, key))
        return built

    def _scalar(self, node: yaml.ScalarNode, loc: Loc) -> Any:
        text: str = node.value
        if node.tag.startswith("!") or (
            node.tag.startswith("tag:") and not node.tag.startswith("tag:yaml.org,2002:")
        ):
            raise SpecError(f"tag {node.tag!r} is not read", where=self.values[loc])
        if node.style:
            return text
        if text in _WORDS:
            return _WORDS[text]
        if _NON_FINITE.match(text):
            raise SpecError(
                f"{text} is not a finite number", where=self.values[loc], remedy="Write a number."
            )
        if _INTEGER.match(text):
            return int(text) if len(text) < 400 else self._too_long(loc)
        if _FLOAT.match(text):
            value = float(text)
            if not math.isfinite(value):
                raise SpecError(f"{text} is not a finite number", where=self.values[loc])
            return value
        return text

    def _too_long(self, loc: Loc) -> int:
        raise SpecError("a number of more than 400 digits", where=self.values[loc])


def _mark(mark: Any, path: str) -> SourceLocation:
    return SourceLocation(path, mark.line + 1, mark.column + 1)


def _nearest(places: Mapping[Loc, SourceLocation], loc: Loc) -> SourceLocation:
    while loc and loc not in places:
        loc = loc[:-1]
    return places[loc]


def _yaml_error(error: yaml.YAMLError, path: str) -> SpecError:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    where = _mark(mark, path) if mark is not None else SourceLocation(path, 1, 1)
    problem = getattr(error, "problem", None) or str(error).splitlines()[0]
    return SpecError(f"no valid YAML: {problem}", where=where)


def _problem(document: Located, item: Any, model: type[BaseModel]) -> InputError:
    loc = _real(document.value, item["loc"])
    name = ".".join(map(str, loc)) or model.__name__
    kind = item["type"]
    if kind == "extra_forbidden":
        allowed = _allowed_keys(model, item["loc"][:-1])
        remedy = suggest(str(loc[-1]), allowed) if allowed else "Remove it."
        return SpecError(
            f"{name}: there is no key {loc[-1]!r} here",
            where=document.locate_key(loc),
            remedy=remedy,
        )
    if kind == "missing":
        return SpecError(
            f"{name} is missing", where=document.locate(loc[:-1]), remedy=f"Add `{loc[-1]}:`."
        )
    message = item["msg"].removeprefix("Value error, ")
    value = item["input"]
    shown = "" if isinstance(value, Mapping | list) or repr(value) in message else f" ({value!r})"
    return SpecError(f"{name}: {_inner(message)}{shown}", where=document.locate(loc))


def _inner(message: str) -> str:
    """Drop the class name of an error that was raised inside a validator."""
    return re.sub(r"^(?:[A-Z][A-Za-z]*Error: )", "", message)


def _real(value: Any, loc: Loc) -> Loc:
    """Drop the parts of a validator's location that name union members, not keys."""
    real: list[str | int] = []
    for number, part in enumerate(loc):
        inside = (isinstance(value, Mapping) and part in value) or (
            isinstance(value, list) and isinstance(part, int) and part < len(value)
        )
        if inside:
            value = value[part]
            real.append(part)
        elif number == len(loc) - 1 and isinstance(part, str) and isinstance(value, Mapping):
            real.append(part)
    return tuple(real)


def _allowed_keys(model: type[BaseModel], loc: Loc) -> list[str]:
    """List the keys of the record at a place, following the model's schema."""
    schema = model.model_json_schema(by_alias=True)
    definitions = schema.get("$defs", {})
    current: list[Any] = [schema]
    for part in loc:
        current = [found for item in current for found in _step(item, part, definitions)]
    keys: dict[str, None] = {}
    for item in current:
        for candidate in _expand(item, definitions):
            keys |= dict.fromkeys(candidate.get("properties", {}))
    return list(keys)


def _step(schema: Any, part: str | int, definitions: Mapping[str, Any]) -> list[Any]:
    found: list[Any] = []
    for candidate in _expand(schema, definitions):
        if isinstance(part, int):
            found.append(candidate.get("items", {}))
        elif part in candidate.get("properties", {}):
            found.append(candidate["properties"][part])
        elif isinstance(candidate.get("additionalProperties"), dict):
            found.append(candidate["additionalProperties"])
        elif candidate.get("patternProperties"):
            found += list(candidate["patternProperties"].values())
        else:
            found.append(candidate)
    return found


def _expand(schema: Any, definitions: Mapping[str, Any]) -> list[Any]:
    if not isinstance(schema, dict):
        return []
    if "$ref" in schema:
        return _expand(definitions.get(schema["$ref"].rsplit("/", 1)[-1], {}), definitions)
    options = [*schema.get("anyOf", []), *schema.get("oneOf", [])]
    if options:
        return [found for option in options for found in _expand(option, definitions)]
    return [schema]
