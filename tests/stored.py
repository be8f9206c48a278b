"""What tests keep in YAML, as users write it: ODDs, scenarios, plug-ins, reports, tables."""

from pathlib import Path
from typing import Any, TypeVar

import yaml

Thing = TypeVar("Thing")


def stored(name: str) -> Any:
    """Read a file of ``tests/content``."""
    path = Path(__file__).parent / "content" / f"{name}.yaml"
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def known(thing: Thing | None) -> Thing:
    """Say that something is there, which a type alone does not."""
    assert thing is not None
    return thing
