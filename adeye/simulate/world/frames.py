"""Frames in a tree, map to ego to sensor: x forward, y left, heading counter-clockwise (ISO 8855).

A pose is a place in the parent frame with a rotation: the heading first, then the pitch about the
turned y axis, nose down positive. Roll is not modelled. The ego stays level; sensors may pitch.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.signals import EGO_HEADING, EGO_X, EGO_Y, Floats

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.spec.sensors import Mount

MAP: Final = "map"
EGO: Final = "ego"


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a frame's origin is in its parent, and how it is turned.

    Attributes:
        x: Forward in the parent (...) [m].
        y: To the left in the parent (...) [m].
        z: Up (...) [m].
        heading: Counter-clockwise from the parent's x axis (...) [rad].
        pitch: Of the x axis below the parent's horizontal plane (...) [rad].
    """

    x: Floats
    y: Floats
    z: Floats
    heading: Floats
    pitch: Floats = field(default_factory=lambda: np.zeros(()))

    @classmethod
    def of_ego(cls, ego: Floats) -> Pose:
        """Return the vehicle frame in the map: centre of the box, on the ground.

        Args:
            ego: Ego states (..., 7), see ``signals.EGO_COLUMNS``.
        """
        x, y = ego[..., EGO_X], ego[..., EGO_Y]
        return cls(x, y, np.zeros_like(x), ego[..., EGO_HEADING])

    @classmethod
    def of_mount(cls, mount: Mount) -> Pose:
        """Return a sensor's frame in the vehicle."""
        values = (mount.x, mount.y, mount.z, mount.yaw, mount.pitch)
        return cls(*(np.asarray(value, dtype=np.float64) for value in values))

    def out(self, points: Floats) -> Floats:
        """Express points of this frame in its parent.

        Args:
            points: (..., 3) [m]; leading axes broadcast with the pose.
        """
        cos, sin = np.cos(self.heading), np.sin(self.heading)
        down, level = np.sin(self.pitch), np.cos(self.pitch)
        y = points[..., 1]
        x = level * points[..., 0] + down * points[..., 2]
        z = level * points[..., 2] - down * points[..., 0]
        turned = (self.x + cos * x - sin * y, self.y + sin * x + cos * y, self.z + z)
        return np.stack(np.broadcast_arrays(*turned), axis=-1)

    def into(self, points: Floats) -> Floats:
        """Express points of the parent in this frame, the inverse of ``out``.

        Args:
            points: (..., 3) [m]; leading axes broadcast with the pose.
        """
        cos, sin = np.cos(self.heading), np.sin(self.heading)
        down, level = np.sin(self.pitch), np.cos(self.pitch)
        x, y, z = points[..., 0] - self.x, points[..., 1] - self.y, points[..., 2] - self.z
        ahead = cos * x + sin * y
        turned = (level * ahead - down * z, -sin * x + cos * y, down * ahead + level * z)
        return np.stack(np.broadcast_arrays(*turned), axis=-1)


class FrameTree:
    """Frames by name, each with its pose in a parent; the root is the map."""

    def __init__(self) -> None:
        self._frames: dict[str, tuple[str, Pose]] = {}

    def add(self, name: str, pose: Pose, parent: str = MAP) -> None:
        """Add a frame below one that is there.

        Raises:
            ValueError: The name is taken, or there is no such parent.
        """
        if name == MAP or name in self._frames:
            msg = f"frame {name!r} is there already"
            raise ValueError(msg)
        if parent != MAP and parent not in self._frames:
            msg = f"frame {name!r} hangs on {parent!r}, none of {', '.join(self.names)}"
            raise ValueError(msg)
        self._frames[name] = (parent, pose)

    @property
    def names(self) -> tuple[str, ...]:
        """All frames, the root first."""
        return (MAP, *self._frames)

    def transform(self, points: Floats, *, source: str, target: str) -> Floats:
        """Express points of one frame in another.

        Args:
            points: (..., 3) [m] in the source frame.
            source: Name of their frame.
            target: Name of the wanted frame.

        Raises:
            KeyError: There is no such frame.
        """
        here = points
        for pose in self._chain(source):
            here = pose.out(here)
        for pose in reversed(self._chain(target)):
            here = pose.into(here)
        return here

    def heading(self, angle: Floats, *, source: str, target: str) -> Floats:
        """Express a direction of one frame in another, not wrapped [rad].

        Seen from above, so pitch does not enter. A direction with an elevation is the difference of
        two points that went through ``transform``.
        """
        here = angle
        for pose in self._chain(source):
            here = here + pose.heading
        for pose in self._chain(target):
            here = here - pose.heading
        return here

    def _chain(self, name: str) -> list[Pose]:
        poses: list[Pose] = []
        while name != MAP:
            name, pose = self._frames[name]
            poses.append(pose)
        return poses


def vehicle_frames(ego: Floats, mounts: Mapping[str, Mount]) -> FrameTree:
    """Build the tree of an ego and its sensors.

    Args:
        ego: Ego states (..., 7), see ``signals.EGO_COLUMNS``.
        mounts: Pose of each sensor in the vehicle.

    >>> from adeye.spec.sensors import Mount
    >>> ego = np.array([100.0, 5.0, np.pi / 2, 20.0, 0.0, 0.0, 0.0])
    >>> tree = vehicle_frames(ego, {"front": Mount.model_validate({"x": "2 m"})})
    >>> tree.transform(np.array([10.0, 0.0, 0.0]), source="front", target="map").round(9)
    array([100.,  17.,   0.])
    """
    tree = FrameTree()
    tree.add(EGO, Pose.of_ego(ego))
    for name, mount in mounts.items():
        tree.add(name, Pose.of_mount(mount), EGO)
    return tree
