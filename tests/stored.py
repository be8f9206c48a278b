"""What tests keep in YAML, as users write it: ODDs, scenarios, plug-ins, reports, tables."""

from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import yaml

Thing = TypeVar("Thing")


def read_yaml(path: Path) -> Any:
    """Read a YAML file, by the library in C where there is one: it is ten times as fast."""
    text = path.read_text("utf-8")
    try:
        return yaml.load(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader))  # noqa: S506 - safe, both
    except yaml.YAMLError:
        # Some of it is no text of Unicode, which the library in C refuses.
        return yaml.safe_load(text)


def write_yaml(path: Path, content: Any) -> None:
    """Write a YAML file, by the library in C where there is one."""
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    path.write_text(yaml.dump(content, Dumper=dumper, sort_keys=False), "utf-8")


def stored(name: str) -> Any:
    """Read a file of ``tests/content``: many tests share one, and each gets its own."""
    return deepcopy(_content(name))


@cache
def _content(name: str) -> Any:
    return read_yaml(Path(__file__).parent / "content" / f"{name}.yaml")


def known(thing: Thing | None) -> Thing:
    """Say that something is there, which a type alone does not."""
    assert thing is not None
    return thing
