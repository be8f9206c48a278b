"""Identity is content: canonical JSON and its sha256, never position, order, time or worker."""

from __future__ import annotations

import hashlib
import json
import math
import unicodedata
from collections.abc import Mapping, Sequence
from typing import Any


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
    plain = _plain(value)
    return json.dumps(
        plain, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False
    ).encode()


def digest(value: Any) -> str:
    """Hash a value's canonical JSON with sha256, in hex."""
    return digest_bytes(canonical_json(value))


def digest_bytes(content: bytes) -> str:
    """Hash bytes with sha256, in hex."""
    return hashlib.sha256(content).hexdigest()


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
    preimage = [odd_seed, replicate, scenario, {k: float(v) for k, v in parameters.items()}]
    return int.from_bytes(hashlib.sha256(canonical_json(preimage)).digest()[:8], "big")


def _plain(value: Any) -> Any:
    if value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, float):
        if not math.isfinite(value):
            msg = f"{value!r} has no canonical form"
            raise ValueError(msg)
        return 0.0 if value == 0.0 else float(value)
    if isinstance(value, str):
        return unicodedata.normalize("NFC", value)
    if isinstance(value, Mapping):
        return _object(value)
    # Bytes are a sequence of ints for Python; here they would be mistaken for a list.
    if isinstance(value, Sequence) and not isinstance(value, bytes | bytearray | memoryview):
        return [_plain(item) for item in value]
    msg = f"{type(value).__name__} has no canonical form"
    raise ValueError(msg)


def _object(value: Mapping[Any, Any]) -> dict[str, Any]:
    plain: dict[str, Any] = {}
    for key, item in value.items():
        name = unicodedata.normalize("NFC", key) if isinstance(key, str) else None
        if name is None or name in plain:
            msg = f"key {key!r} is {'not text' if name is None else 'twice there'}"
            raise ValueError(msg)
        plain[name] = _plain(item)
    return plain
