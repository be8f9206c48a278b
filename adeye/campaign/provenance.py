"""Where a campaign comes from: tool, packages, machine and processor, git state, who.

Nothing is taken from the environment but the name of the user: it may hold secrets.
"""

from __future__ import annotations

import getpass
import platform
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

from adeye.version import __version__

_PROCESSORS: Final = Path("/proc/cpuinfo")

PACKAGES: Final = (
    "alembic", "gymnasium", "highway-env", "jinja2", "llvmlite", "numba", "numpy", "pandas",
    "pydantic", "pyyaml", "rich", "scipy", "sqlalchemy", "typer",
)  # fmt: skip
"""What adeye depends on, and what compiles its kernels."""
# A repository may name a program that watches its files; looking at it starts none.
_QUIET = ("-c", "core.fsmonitor=false", "--no-optional-locks")


def provenance(odd_path: Path) -> dict[str, Any]:
    """Collect what a reader needs to trust or repeat a campaign.

    Args:
        odd_path: The ODD's file, whose git state is noted.
    """
    return {
        "adeye": __version__,
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
        "host": platform.node(),
        "libm": " ".join(platform.libc_ver()).strip(),
        "cpu": processor(),
        "packages": {name: _version(name) for name in PACKAGES},
        "git": git_state(odd_path.resolve().parent),
        "odd_path": odd_path.as_posix(),
        "who": _user(),
    }


@cache
def processor() -> dict[str, Any]:
    """Name, kind and features of the processor, as the compiler of the kernels sees them."""
    import llvmlite.binding as llvm

    features = llvm.get_host_cpu_features()
    return {
        "name": _model() or platform.processor() or platform.machine(),
        "kind": llvm.get_host_cpu_name(),
        "features": sorted(name for name, is_there in features.items() if is_there),
    }


def _model() -> str:
    try:
        lines = _PROCESSORS.read_text("utf-8", "replace").splitlines()
    except OSError:
        return ""
    found = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(found, "")


def git_state(folder: Path) -> dict[str, Any]:
    """Commit of the repository that a folder is in and whether it has changes; empty if none."""
    commit = _git(folder, "rev-parse", "HEAD")
    if not commit:
        return {}
    return {"commit": commit, "is_dirty": bool(_git(folder, "status", "--porcelain"))}


def _git(folder: Path, *arguments: str) -> str:
    try:
        done = subprocess.run(  # noqa: S603 - no shell, our own words
            ["git", *_QUIET, "-C", str(folder), *arguments],  # noqa: S607 - the user's own git
            capture_output=True,
            text=True,
            timeout=10,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return ""
