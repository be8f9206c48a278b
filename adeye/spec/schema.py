"""JSON Schemas of everything that users write, for editors; ``--check`` fails when they are stale.

``python -m adeye.spec.schema docs/schema`` writes them,
``python -m adeye.spec.schema --check docs/schema`` compares.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel

from adeye.spec.architecture import Architecture
from adeye.spec.concept import Concept
from adeye.spec.grid import GridSettings
from adeye.spec.odd import Odd
from adeye.spec.scenario import LogicalScenario

KINDS: Final[dict[str, type[BaseModel]]] = {
    "odd": Odd,
    "scenario": LogicalScenario,
    "architecture": Architecture,
    "concept": Concept,
    "grid": GridSettings,
}


def schema(kind: str) -> dict[str, Any]:
    """Return the JSON Schema of a kind of file.

    Args:
        kind: ``odd``, ``scenario``, ``architecture``, ``concept`` or ``grid``.
    """
    made = KINDS[kind].model_json_schema(by_alias=True)
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": f"adeye/{kind}@1"}
    made = head | made
    by_what = "by id or path" if kind == "scenario" else "by path"
    extends = {"type": "string", "description": f"Another {kind}, {by_what}."}
    # A file that extends another leaves out what it takes over, at every depth.
    part = _partial({"properties": made["properties"]})
    part["properties"]["extends"] = extends
    parts = {f"{name}.part": _partial(item) for name, item in made.pop("$defs").items()}
    names = ("properties", "required", "additionalProperties")
    whole = {name: made.pop(name) for name in names if name in made}
    definitions = KINDS[kind].model_json_schema(by_alias=True)["$defs"]
    closed = {"additionalProperties": False}
    made |= {"if": {"required": ["extends"]}, "then": part | closed, "else": whole}
    return made | {"$defs": definitions | parts}


def _partial(schema: Any) -> Any:
    """Allow a part of a schema: nothing is required, null removes a key, and references stay so."""
    if isinstance(schema, list):
        return [_partial(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    made: dict[str, Any] = {}
    for name, item in schema.items():
        if name == "$ref":
            made[name] = f"{item}.part"
        elif name in {"properties", "patternProperties"}:
            made[name] = {key: _or_null(_partial(value)) for key, value in item.items()}
        elif name == "additionalProperties" and isinstance(item, dict):
            made[name] = _or_null(_partial(item))
        elif name == "oneOf":
            # Without the key that tells them apart, several may fit.
            made["anyOf"] = _partial(item)
        elif name not in {"required", "discriminator", "minProperties"}:
            made[name] = _partial(item)
    return made


def _or_null(schema: Any) -> dict[str, Any]:
    return {"anyOf": [schema, {"type": "null"}]}


def schema_text(kind: str) -> str:
    """Write the JSON Schema of a kind as the file in ``docs/schema`` has it."""
    return json.dumps(schema(kind), indent=2, ensure_ascii=False) + "\n"


def stale(folder: Path) -> list[str]:
    """List the schema files of a folder that differ from the models."""
    return [
        f"{kind}.schema.json"
        for kind in KINDS
        if not (folder / f"{kind}.schema.json").is_file()
        or (folder / f"{kind}.schema.json").read_text(encoding="utf-8") != schema_text(kind)
    ]


def write(folder: Path) -> None:
    """Write the schema files into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for kind in KINDS:
        (folder / f"{kind}.schema.json").write_text(schema_text(kind), encoding="utf-8")


def main(arguments: list[str]) -> int:
    """Write or check the schema files; returns the exit code."""
    folder = Path(arguments[-1])
    if "--check" not in arguments:
        write(folder)
        return 0
    old = stale(folder)
    for name in old:
        sys.stderr.write(f"{folder / name} is stale; run python -m adeye.spec.schema {folder}\n")
    return 1 if old else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
