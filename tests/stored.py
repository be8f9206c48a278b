"""What tests keep in YAML, as users write it: ODDs, scenarios, parts of architectures, tables."""

from pathlib import Path
from typing import Any

import yaml


def stored(name: str) -> Any:
    """Read a file of ``tests/content``."""
    path = Path(__file__).parent / "content" / f"{name}.yaml"
    return yaml.safe_load(path.read_text(encoding="utf-8"))
