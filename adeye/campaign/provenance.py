"""Where a campaign comes from: tool, packages, machine, git state, who."""

from __future__ import annotations

import getpass
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from adeye.version import __version__

if TYPE_CHECKING:
    from pathlib import Path

# A repository may name a program that watches its files; looking at it starts none.
_QUIET = ("-c", "core.fsmonitor=false", "--no-optional-locks")
PACKAGES = ("highway-env", "numba", "numpy", "pydantic", "scipy", "sqlalchemy")


def provenance(odd_path: Path) -> dict[str, Any]:
    """Collect what a reader needs to trust or repeat a campaign.

    Args:
        odd_path: The ODD's file, whose git state is noted.
    """
    return {
        "adeye": __version__,
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
        "packages": {name: _version(name) for name in PACKAGES},
        "git": git_state(odd_path.resolve().parent),
        "odd_path": odd_path.as_posix(),
        "who": _user(),
    }


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
