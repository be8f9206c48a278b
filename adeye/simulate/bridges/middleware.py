"""Which middleware is installed, and how a node is asked over it."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

from adeye.errors import InputError, MissingExtra
from adeye.simulate.bridges import bridge_program

if TYPE_CHECKING:
    from collections.abc import Mapping

ROS_1: Final = "/usr/lib/python3/dist-packages"
"""Where Debian's packages of ROS 1 lie, outside of any environment."""

MIDDLEWARE: Final[Mapping[str, str]] = {"ros1": "rospy", "ros2": "cyclonedds", "zenoh": "zenoh"}
"""The package that each needs, by the kind of channel."""

COUNTS_AS: Final = 8
"""Programs that a node counts as where programs at once are bounded: two interpreters and a
middleware take up to 60 MiB and 0.3 s of two processors each time. Our choice."""


def require(kind: str) -> None:
    """Refuse a kind of channel whose middleware is not installed; others pass.

    Raises:
        MissingExtra: It is not, and an extra brings it.
        InputError: It is not, and Debian has it.
    """
    package = MIDDLEWARE.get(kind)
    if package is None or find_spec(package) is not None or Path(ROS_1, package).is_dir():
        return
    if kind != "ros1":
        raise MissingExtra.of(f"kind {kind}", kind)
    raise InputError(
        f"kind {kind} needs {package}, which is not installed",
        remedy="Install it: apt-get install ros-core python3-rospy.",
    )


def bridge(kind: str) -> tuple[str, ...]:
    """Return what is started before the command of a node."""
    return (sys.executable, "-I", "-B", bridge_program.__file__, kind)
