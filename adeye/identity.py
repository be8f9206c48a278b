"""Identity is content: canonical JSON and its sha256, never position, order, time or worker.

``canonical_json`` defines it. Plans have millions of values of one shape, whose constant parts are
written once: ``JsonRows`` gives the same bytes row by row.
"""

from __future__ import annotations

import hashlib
import json
import math
import unicodedata
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from functools import partial, singledispatch
from pathlib import Path
from types import CodeType, FunctionType, ModuleType, SimpleNamespace
from typing import Any, Final


def canonical_json(value: Any) -> bytes:
    """Write a value as JSON in the one way that is hashed.

    Keys are sorted by code point, strings are NFC, floats are the shortest that read back, -0.0 is
    0.0. A float without a fraction is written as a float (``1.0``), an int as an int, so that the
    two differ: a count is never equal to a measured value by accident.

    Args:
        value: Mappings with string keys, sequences, strings, numbers, booleans and None.

    Raises:
        ValueError: A number is not finite, a value or key of another type, text that is no
            Unicode, or two keys that are equal in NFC.

    >>> canonical_json({"b": -0.0, "a": [1, True]})
    b'{"a":[1,true],"b":0.0}'
    """
    return _dumps(_plain(value)).encode()


def canonical(value: Any) -> Any:
    """Return a value as its canonical JSON says it: what is identified alike is handed over alike.

    >>> canonical({"b": (-0.0,), "a": 1})
    {'a': 1, 'b': [0.0]}
    """
    return json.loads(canonical_json(value))


def digest(value: Any) -> str:
    """Hash a value's canonical JSON with sha256, in hex."""
    return digest_bytes(canonical_json(value))


@dataclass(frozen=True, slots=True)
class JsonRows:
    """Canonical JSON of many mappings that differ in the values of some keys.

    Attributes:
        varied: These keys, in the order in which they are written.
        template: For ``%``, with one place for the text of each varied value.
    """

    varied: tuple[str, ...]
    template: str

    @classmethod
    def of(cls, constant: Mapping[str, Any], varied: Iterable[str]) -> JsonRows:
        """Write what the mappings share.

        Args:
            constant: Keys and values that are the same in all.
            varied: The other keys.

        Raises:
            ValueError: A value has no canonical form, or two keys are equal in NFC.
        """
        given = tuple(varied)
        names = {unicodedata.normalize("NFC", name): name for name in given}
        shared = _object(constant)
        if len(names) != len(given) or names.keys() & shared.keys():
            raise ValueError(f"keys {[*shared, *given]} are not all different")
        order = sorted([*names, *shared])
        members = [
            f"{_escaped(name)}:{'%s' if name in names else _escaped(shared[name])}"
            for name in order
        ]
        varying = tuple(names[name] for name in order if name in names)
        return cls(varying, "{" + ",".join(members) + "}")

    def texts(self, columns: Mapping[str, Sequence[str]], rows: int) -> list[str]:
        """Write every mapping.

        Args:
            columns: Canonical JSON of the values, by varied key.
            rows: How many there are.
        """
        if not self.varied:
            return [self.template % ()] * rows
        chosen = [columns[name] for name in self.varied]
        return [self.template % values for values in zip(*chosen, strict=True)]


def digest_bytes(content: bytes) -> str:
    """Hash bytes with sha256, in hex."""
    return hashlib.sha256(content).hexdigest()


def file_digest(path: Path) -> str:
    """Hash a file with sha256, in hex.

    Raises:
        OSError: It cannot be read.
    """
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Read a JSON object for ``json.loads``, whose readers would take the last of two equal keys.

    Raises:
        ValueError: A key is there twice.
    """
    made = dict(pairs)
    if len(made) != len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"{twice!r} is there twice")
    return made


def stream_seed(
    odd_seed: int, replicate: int, scenario: str, parameters: Mapping[str, float]
) -> int:
    """Derive the seed of a situation's random streams.

    Args:
        odd_seed: Seed of the ODD.
        replicate: Number of the replicate.
        scenario: Id of the scenario.
        parameters: Resolved scenario parameters in SI.

    Returns:
        64 bits of the sha256 of all of them; architecture, faults and step are not among them.
    """
    texts = JsonRows.of({name: float(value) for name, value in parameters.items()}, ()).texts({}, 1)
    return stream_seeds(odd_seed, scenario, [replicate], texts)[0]


def stream_seeds(
    odd_seed: int, scenario: str, replicates: Iterable[int], parameters: Iterable[str]
) -> list[int]:
    """Derive the seeds of many situations of one scenario.

    Args:
        odd_seed: Seed of the ODD.
        scenario: Id of the scenario.
        replicates: Their numbers.
        parameters: Canonical JSON of their resolved parameters in SI.
    """
    sha256, name = hashlib.sha256, _dumps(_plain(scenario))
    return [
        int.from_bytes(sha256(f"[{odd_seed},{number},{name},{text}]".encode()).digest()[:8], "big")
        for number, text in zip(replicates, parameters, strict=True)
    ]


def digests(texts: Iterable[str]) -> list[str]:
    """Hash texts with sha256, in hex."""
    sha256 = hashlib.sha256
    return [sha256(text.encode()).hexdigest() for text in texts]


def _dumps(plain: Any) -> str:
    return json.dumps(
        plain, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False
    )


def _escaped(plain: Any) -> str:
    return _dumps(plain).replace("%", "%%")


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"{value!r} has no canonical form")
        return 0.0 if value == 0.0 else float(value)
    if value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, str):
        return unicodedata.normalize("NFC", value)
    if isinstance(value, Mapping):
        return _object(value)
    # Bytes are a sequence of ints for Python; here they would be mistaken for a list.
    if isinstance(value, Sequence) and not isinstance(value, bytes | bytearray | memoryview):
        return [_plain(item) for item in value]
    raise ValueError(f"{type(value).__name__} has no canonical form")


def _object(value: Mapping[Any, Any]) -> dict[str, Any]:
    plain: dict[str, Any] = {}
    for key, item in value.items():
        name = unicodedata.normalize("NFC", key) if isinstance(key, str) else None
        if name is None or name in plain:
            raise ValueError(f"key {key!r} is {'not text' if name is None else 'twice there'}")
        plain[name] = _plain(item)
    return plain


# --- What the variables of a module hold ----------------------------------------------------------

_PLAIN: Final = (type(None), bool, int, float, complex, str, bytes)
_DEEPEST: Final = 8
"""How far lists in lists and attributes of attributes are followed."""


def variables_of(namespace: Mapping[str, Any], *, is_deep: bool) -> dict[str, str]:
    """Say what variables hold, as text that is equal where that is.

    Of functions and classes of the module it is their code and attributes, of others the name; of
    objects that are plain records, or of a class of the module, their attributes, else the type.

    Args:
        namespace: Of a module.
        is_deep: Whether all are told; else only numbers, texts and tuples of them.

    >>> variables_of({"a": 1, "b": [1]}, is_deep=False)
    {'a': '1'}
    """
    return {
        name: told
        for name, value in namespace.items()
        if not (name.startswith("__") and name.endswith("__")) and not isinstance(value, ModuleType)
        if (told := _told(value, namespace.get("__name__")) if is_deep or _is_plain(value) else "")
    }


def _is_plain(value: Any) -> bool:
    return type(value) in _PLAIN or (type(value) is tuple and all(map(_is_plain, value)))


def _told(value: Any, home: str | None, above: tuple[int, ...] = ()) -> str:
    if type(value) in _PLAIN:
        return repr(value)
    if id(value) in above or len(above) > _DEEPEST:
        return "…"
    tell = partial(_told, home=home, above=(*above, id(value)))
    is_record = isinstance(value, SimpleNamespace) or is_dataclass(value)
    if isinstance(value, type | FunctionType):
        is_own = value.__module__ == home
        inside = [value.__module__, value.__qualname__, *(_parts(value, tell) if is_own else ())]
    elif is_record or type(value).__module__ == home:
        inside = [tell(_attributes(value))]
    else:
        inside = _parts(value, tell)
    return f"{type(value).__qualname__}({', '.join(inside)})"


@singledispatch
def _parts(value: Any, tell: Callable[[Any], str]) -> list[str]:
    """Say what a value consists of, each part as text."""
    if type(value).__module__ == "numpy" and hasattr(value, "tobytes"):
        return [str(value.dtype), str(value.shape), digest_bytes(value.tobytes())]
    # A function that is compiled.
    return [tell(value.py_func)] if hasattr(value, "py_func") else []


@_parts.register
def _(value: Mapping, tell: Callable[[Any], str]) -> list[str]:  # type: ignore[type-arg]
    return sorted(f"{tell(key)}: {tell(item)}" for key, item in value.items())


@_parts.register
def _(value: set | frozenset, tell: Callable[[Any], str]) -> list[str]:  # type: ignore[type-arg]
    return sorted(map(tell, value))


@_parts.register
def _(value: list | tuple, tell: Callable[[Any], str]) -> list[str]:  # type: ignore[type-arg]
    return list(map(tell, value))


@_parts.register
def _(value: CodeType, tell: Callable[[Any], str]) -> list[str]:
    return [value.co_code.hex(), *map(tell, value.co_consts), *value.co_names]


@_parts.register
def _(value: FunctionType, tell: Callable[[Any], str]) -> list[str]:
    cells = [cell.cell_contents for cell in value.__closure__ or ()]
    parts = (value.__code__, value.__defaults__, value.__kwdefaults__, cells, vars(value))
    return list(map(tell, parts))


@_parts.register
def _(value: type, tell: Callable[[Any], str]) -> list[str]:
    return [tell(_attributes(value))]


def _attributes(value: Any) -> dict[str, Any]:
    own = getattr(value, "__dict__", {})
    return {name: item for name, item in own.items() if not name.startswith("__")}
