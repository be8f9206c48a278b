"""Ways to spoil a file or a text, drawn from a seed: bytes, YAML structure, grammars."""

from __future__ import annotations

import json
from collections.abc import Sequence
from copy import deepcopy
from typing import Any, Final

import numpy as np
import yaml

Draw = np.random.Generator

SURPRISES: Final = (
    "no", "on", "017", "1e3", "12:30:00", "2026-01-01", ".nan", "-.inf", "1e999", "-0.0", "0x7f",
    "9" * 400, "1" + "0" * 5000, "''", "null", "~", "[]", "{}", "[[[[]]]]", "{a: {a: {a: b}}}",
    "!!python/object/apply:os.system ['true']", "!!binary aGk=", "&a [*a]", "*nobody", "<<: {a: b}",
    "\N{RIGHT-TO-LEFT OVERRIDE}x", "\x00", "\x1b[31mred", "\ufeff", "\ud7ff", "\U0010ffff",
    "1_000", "1 m", "-1e-320 m", "5 m/s^2/s", "%s%n", "{{7*7}}", "${HOME}", "../../etc/passwd",
    "/dev/zero", "\\N", "a: b: c", "- ", "? x", "|\n  x", ">\n  x", "# x", "\t", "\r\n",
    "%YAML 1.1", "'" * 50, "---", "...", "@", "`", "e\N{COMBINING ACUTE ACCENT}", "١٢٣ m",
    "\uff11\uff12 m", "true", "∞", "5 %",
)  # fmt: skip
"""Pieces that parsers trip over."""

_VALUES: Final[tuple[Any, ...]] = (
    None, True, False, 0, -1, 2**63, 2**64, 10**400, 1e308, -1e308, 5e-324, float("nan"),
    float("inf"), "", " ", "x", "a" * 10_000, [], {}, [[]], [None], {"": None}, {"a": {}},
    "\N{RIGHT-TO-LEFT OVERRIDE}gap", "\x1b[2J", "1 m", "1e9 km", "-5 s", "0 Hz", "1e-9 s",
    "always(", "gap > 1 m", "__class__", "../x.yaml", "/etc/passwd", "\N{SNOWMAN}", 1.5, ["a", "a"],
)  # fmt: skip


def bytes_of(content: bytes, draw: Draw) -> bytes:
    """Change a few bytes: flip, cut, repeat, insert a piece, change line ends, add a mark."""
    out = bytearray(content)
    for _ in range(int(draw.integers(1, 4))):
        at = int(draw.integers(0, max(1, len(out))))
        to = min(len(out), at + int(draw.integers(1, 40)))
        way = int(draw.integers(0, 9))
        if way == 0 and out:
            out[min(at, len(out) - 1)] ^= 1 << int(draw.integers(0, 8))
        elif way == 1:
            del out[at:to]
        elif way == 2:
            out[at:at] = out[at:to] * int(draw.integers(1, 200))
        elif way in {3, 4}:
            out[at:at] = _piece(draw)
        elif way == 5:
            out[at:to] = _piece(draw)
        elif way == 6:
            out = out.replace(b"\n", (b"\r\n", b"\r", b"\n\n", b"\n\t")[int(draw.integers(0, 4))])
        elif way == 7:
            out[:0] = (b"\xef\xbb\xbf", b"\xff\xfe", b"\x00", b"---\n")[int(draw.integers(0, 4))]
        else:
            del out[at:]
    return bytes(out)


def _piece(draw: Draw) -> bytes:
    return str(draw.choice(np.array(SURPRISES, dtype=object))).encode("utf-8", "surrogatepass")


def _value(draw: Draw) -> Any:
    # A copy: what is put into a tree is changed with it.
    return deepcopy(_VALUES[int(draw.integers(0, len(_VALUES)))])


def structure(content: bytes, draw: Draw) -> bytes:
    """Change the tree of a YAML file: swap values, drop, rename and add keys, nest, swap places."""
    tree = yaml.safe_load(content)
    for _ in range(int(draw.integers(1, 4))):
        places = list(_places(tree))
        if not places:
            break
        holder, key = places[int(draw.integers(0, len(places)))]
        way = int(draw.integers(0, 7))
        if way == 0:
            del holder[key]
        elif way in {1, 2}:
            holder[key] = _value(draw)
        elif way == 3:
            for _ in range(int(draw.integers(1, 70))):
                holder[key] = [holder[key]] if draw.integers(0, 2) else {"a": holder[key]}
        elif way == 4:
            other, there = places[int(draw.integers(0, len(places)))]
            holder[key] = json.loads(json.dumps(other.get(there) if isinstance(other, dict) else
                                                None, default=str))  # fmt: skip
        elif way == 5 and isinstance(holder, dict):
            holder[f"{key}{_value(draw)}"[:300]] = holder.pop(key)
        elif isinstance(holder, list):
            holder.extend(holder[:1] * int(draw.integers(1, 300)))
        else:
            holder[str(draw.integers(0, 10**9))] = holder[key]
    text = yaml.safe_dump(tree, sort_keys=False, allow_unicode=True)
    return text.encode("utf-8", "surrogatepass")


def _places(tree: Any) -> list[tuple[Any, Any]]:
    """List where a tree holds something: its collections with each of their keys."""
    found: list[tuple[Any, Any]] = []
    waiting = [tree]
    while waiting:
        item = waiting.pop()
        keys: Sequence[Any] = ()
        if isinstance(item, dict):
            keys = list(item)
        elif isinstance(item, list):
            keys = range(len(item))
        for key in keys:
            found.append((item, key))
            waiting.append(item[key])
    return found


FORMULA_WORDS: Final = (
    "always", "eventually", "once", "historically", "until", "since", "implies", "and", "or", "not",
    "(", ")", "[", "]", "[0 s, 1 s]", "[1 s, 0 s]", "[0 s, 1e300 s]", "[-1 s, 2 s]", ",", "gap",
    "ttc", "mode", "x", "contact", ">", "<", ">=", "==", "!=", "=", "2 m", "0", "1e308", "nan", "+",
    "-", "*", "/", "abs", "min", "max", "rise", "fall", "'on'", "\"", ".", "authority.safety", "^",
    "is", "in", "%", "\N{MINUS SIGN}", "\N{RIGHT-TO-LEFT OVERRIDE}", "\x00", "\n", "#", "true",
    "1e400 m",
)  # fmt: skip


def formula(valid: Sequence[str], draw: Draw) -> str:
    """Write words of the language in any order, or spoil a formula that is one."""
    way = int(draw.integers(0, 5))
    if way == 0:
        many = int(draw.integers(1, 60))
        return " ".join(str(item) for item in draw.choice(np.array(FORMULA_WORDS), many))
    one = valid[int(draw.integers(0, len(valid)))]
    if way == 1:
        deep = int(draw.integers(1, 3000))
        opening = ("(", "not ", "always(", "-", "not (")[int(draw.integers(0, 5))]
        return opening * deep + one + ")" * int(draw.integers(0, deep + 1))
    if way == 2:
        joint = (" and ", " or ", " implies ", " + ", " until ")[int(draw.integers(0, 5))]
        return joint.join([one] * int(draw.integers(2, 800)))
    if way == 3:
        words = one.split(" ")
        words[int(draw.integers(0, len(words)))] = str(draw.choice(np.array(FORMULA_WORDS)))
        return " ".join(words)
    return bytes_of(one.encode(), draw).decode("utf-8", "replace")


def table(content: bytes, draw: Draw) -> bytes:
    """Change cells of a CSV file, or its bytes."""
    if draw.integers(0, 2):
        return bytes_of(content, draw)
    rows = [line.split(",") for line in content.decode().splitlines()]
    for _ in range(int(draw.integers(1, 5))):
        row = rows[int(draw.integers(0, len(rows)))]
        at = int(draw.integers(0, len(row)))
        way = int(draw.integers(0, 5))
        if way == 0:
            row.insert(at, "1")
        elif way == 1:
            row[at] = '"' + row[at]
        elif way == 2:
            row[at] = "9" * int(draw.integers(1, 200_000))
        else:
            row[at] = _piece(draw).decode("utf-8", "replace")
    return "\n".join(",".join(row) for row in rows).encode("utf-8", "surrogatepass")


def tree_of_json(content: bytes, draw: Draw) -> bytes:
    """Change the tree of a JSON file, or its bytes."""
    if draw.integers(0, 2):
        return bytes_of(content, draw)
    tree = json.loads(content)
    places = _places(tree)
    for _ in range(int(draw.integers(1, 4))):
        holder, key = places[int(draw.integers(0, len(places)))]
        try:
            holder[key] = _value(draw)
        except IndexError:
            continue
    return json.dumps(tree).encode()
