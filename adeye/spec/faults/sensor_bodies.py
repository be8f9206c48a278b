"""Faults of a sensor's body: where it looks, how far, and through what."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from adeye.spec.faults.objects import Bearing, Share
from adeye.spec.faults.sensing import SensorFault
from adeye.spec.misplaced import Loc
from adeye.spec.quantity import Angle, Length, Number
from adeye.spec.sensors import PhysicalCamera

if TYPE_CHECKING:
    from adeye.spec.sensors import SensorRecord


class BlindSector(SensorFault):
    """Nothing is seen between two bearings: dirt, or something stands in front of it.

    Bearings are seen from the sensor and counted from the vehicle's x axis, left is positive.
    """

    needs = ("bearings",)
    model: Literal["blind_sector"]
    right: Bearing
    """Where it begins [rad]; from there it goes on to the left, through the rear if need be ..."""
    left: Bearing
    """... up to here. There is none if both are the same."""

    @property
    def nothing(self) -> str:
        """That the sector has no width; empty if it has one."""
        return "right and left the same" if self.right == self.left else ""


class RangeLoss(SensorFault):
    """Only what is nearer than a share of the specified range is seen."""

    needs = ("range",)
    neutral = ({"factor": 1.0},)
    model: Literal["range_loss"]
    factor: Share
    """Share of the range that is left; 1 takes nothing away."""


class Miscalibration(SensorFault):
    """The sensor is turned and shifted against what is known of its mount.

    What it reports lies by as much on the other side. What it can see is not changed: to study
    that, vary its mount.
    """

    needs = ("bearings",)
    neutral = ({"yaw": 0.0, "x": 0.0, "y": 0.0},)
    model: Literal["miscalibration"]
    yaw: Angle = 0.0
    """How far it is turned to the left [rad]."""
    x: Length = 0.0
    """How far ahead of its known place it is [m]."""
    y: Length = 0.0
    """How far to the left of it [m]."""


Pixel = Annotated[int, Field(ge=0, le=1024)]


class _OfPixels(SensorFault):
    """A rectangle of an image; column 0 is at the left, row 0 at the top."""

    needs = ("pixels",)
    column: Pixel = 0
    row: Pixel = 0
    columns: Pixel
    rows: Pixel

    def misfits(self, sensor: SensorRecord) -> list[tuple[Loc, str]]:
        """Say that a sensor has no such pixels."""
        found = super().misfits(sensor)
        if isinstance(sensor, PhysicalCamera):
            size = f"the image is {sensor.columns} x {sensor.rows}"
            if self.column + self.columns > sensor.columns:
                found.append((("columns",), f"the last is beyond the right edge, {size}"))
            if self.row + self.rows > sensor.rows:
                found.append((("rows",), f"the last is beyond the lower edge, {size}"))
        return found


class DeadPixels(_OfPixels):
    """Pixels show nothing or, with some transmission, little: single ones, lines, a rectangle."""

    neutral = ({"columns": 0}, {"rows": 0}, {"transmission": 1.0})
    model: Literal["dead_pixels"]
    transmission: Share = 0.0
    """Share of the contrast that passes."""


class PixelNoise(_OfPixels):
    """The contrast of pixels is noisy."""

    neutral = ({"columns": 0}, {"rows": 0}, {"noise": 0.0})
    model: Literal["pixel_noise"]
    noise: Annotated[Number, Field(ge=0.0)]
    """Standard deviation of Gaussian noise on the contrast of each."""


class Blackout(SensorFault):
    """The whole image is dark."""

    needs = ("pixels",)
    neutral = ({"transmission": 1.0},)
    model: Literal["blackout"]
    transmission: Share = 0.0
    """Share of the contrast that passes."""
