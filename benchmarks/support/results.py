"""What measurements share: the machine, a table, and the JSON file beside the reports."""

from __future__ import annotations

import json
import os
import platform
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

FOLDER = Path(__file__).resolve().parents[2] / "reports" / "benchmarks"
LIBRARIES = ("highway-env", "numba", "numpy", "pydantic", "sqlalchemy", "typer")


def machine() -> dict[str, Any]:
    """Say what was measured on."""
    return {
        "processor": _processor(),
        "processors": os.cpu_count(),
        "load": os.getloadavg()[0],
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "libraries": {name: version(name) for name in LIBRARIES},
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor())


def table(headers: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Write a table of text, the first column flush left."""
    widths = [max(len(row[k]) for row in [headers, *rows]) for k in range(len(headers))]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if k else cell.ljust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in [headers, *rows]
    )


def write_result(name: str, result: Mapping[str, Any], folder: Path = FOLDER) -> Path:
    """Write a result as JSON and return its file; earlier results are kept."""
    now = datetime.now(UTC)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}-{now:%Y%m%dT%H%M%SZ}.json"
    document = {"benchmark": name, "measured_at": now.isoformat(timespec="seconds"), **result}
    path.write_text(json.dumps(document, indent=1) + "\n", "utf-8")
    return path
