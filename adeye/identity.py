"""Identity is content: canonical JSON and its sha256, never position, order, time or worker.

``canonical_json`` defines it. Plans have millions of values of one shape, whose constant parts are
written once: ``JsonRows`` gives the same bytes row by row.
"""

from __future__ import annotations

import hashlib
import json
import math
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from types import CodeType, FunctionType, ModuleType, SimpleNamespace
from typing import Any, Final, NamedTuple


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
    # Exact types first: nearly all are of these, and to ask an abstract class takes ten times as
    # long.
    kind = type(value)
    if kind is list or kind is tuple:
        # A road is thousands of numbers: no call for each.
        return [
            item + 0.0 if type(item) is float and math.isfinite(item) else _plain(item)
            for item in value
        ]
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"{value!r} has no canonical form")
        return float(value) + 0.0
    if value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, str):
        return unicodedata.normalize("NFC", value)
    if isinstance(value, Mapping):
        return _object(value)
    # Bytes are a sequence of ints for Python; here they would be mistaken for a list.
    if isinstance(value, Sequence) and not isinstance(value, bytes | bytearray | memoryview):
        return list(map(_plain, value))
    raise ValueError(f"{kind.__name__} has no canonical form")


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
_LONGEST: Final = 256
"""Items of a list or table that are told one by one; of a longer one it is a hash."""


class Held(NamedTuple):
    """What a variable, or a part of one, holds.

    Attributes:
        is_plain: Whether it is a number, a text, or an array.
        told: It as text, which is equal where it is.
    """

    is_plain: bool
    told: str


def variables_of(namespace: Mapping[str, Any]) -> dict[str, Held]:
    """Say what variables hold, by their names and places in them.

    Of functions and classes of the module it is their code and attributes, of others the name; of
    objects that are plain records, or of a class of the module, their attributes, else the type.

    Args:
        namespace: Of a module.

    >>> {name: held.told for name, held in variables_of({"a": 1, "b": {"c": 2.0}}).items()}
    {'a': '1', "b['c']": '2.0', 'b': 'dict'}
    """
    found: dict[str, Held] = {}
    for name, value in namespace.items():
        is_own = not (name.startswith("__") and name.endswith("__"))
        if is_own and not isinstance(value, ModuleType):
            found.update(_held(name, value, namespace.get("__name__")))
    return found


def _held(
    name: str, value: Any, home: str | None, above: tuple[int, ...] = ()
) -> Iterator[tuple[str, Held]]:
    if type(value) in _PLAIN:
        yield name, Held(is_plain=True, told=repr(value))
        return
    told = type(value).__qualname__
    if id(value) not in above and len(above) <= _DEEPEST:
        inside, more = _parts(value, home)
        told = " ".join((told, *more))
        if len(inside) > _LONGEST:
            told, inside = f"{told} {digest_bytes(repr(inside).encode())}", {}
        for place, item in inside.items():
            yield from _held(f"{name}{place}", item, home, (*above, id(value)))
    yield name, Held(is_plain=type(value).__module__ == "numpy", told=told)


def _parts(value: Any, home: str | None) -> tuple[dict[str, Any], list[str]]:
    """Return what is looked at within a value, by its place, and what is told of it at once."""
    if isinstance(value, Mapping):
        return {f"[{key!r}]": item for key, item in value.items()}, []
    if isinstance(value, list | tuple):
        return {f"[{place}]": item for place, item in enumerate(value)}, []
    if isinstance(value, CodeType):
        constants = {f".co_consts[{place}]": item for place, item in enumerate(value.co_consts)}
        return constants, [value.co_code.hex(), *value.co_names]
    if isinstance(value, type | FunctionType):
        inside = _attributes(value) if value.__module__ == home else {}
        if isinstance(value, FunctionType) and value.__module__ == home:
            cells = [cell.cell_contents for cell in value.__closure__ or ()]
            inside |= {"()": value.__code__, "(=)": value.__defaults__, "(*)": cells}
        return inside, [value.__module__, value.__qualname__]
    return _parts_of_object(value, home)


def _parts_of_object(value: Any, home: str | None) -> tuple[dict[str, Any], list[str]]:
    if isinstance(value, set | frozenset):
        return {}, sorted(map(repr, value))
    kind = type(value)
    if kind.__module__ == "numpy" and hasattr(value, "tobytes"):
        return {}, [str(value.dtype), str(value.shape), digest_bytes(value.tobytes())]
    if hasattr(value, "py_func"):  # a function that is compiled
        return {".py_func": value.py_func}, []
    is_record = isinstance(value, SimpleNamespace) or is_dataclass(value)
    return _attributes(value) if is_record or kind.__module__ == home else {}, []


def _attributes(value: Any) -> dict[str, Any]:
    own = getattr(value, "__dict__", {})
    return {f".{name}": item for name, item in own.items() if not name.startswith("__")}


LINK_LENGTH: Final = 32
"""Characters of a link in hex."""


def split_links(text: str) -> tuple[str, ...]:
    """Give the links of a chain that were written one behind the other."""
    return tuple(text[first : first + LINK_LENGTH] for first in range(0, len(text), LINK_LENGTH))
