"""Physical cameras on hand-made scenes."""

from typing import Any

import numpy as np

from adeye.signals import Measurement, Scene, SceneContext
from adeye.simulate.sensors.camera import Frame, PhysicalCameraSensor
from adeye.simulate.world.weather import MM_PER_HOUR
from adeye.spec.sensors import PhysicalCamera
from tests.simulate.sensors.scenes import sensor_context, sensor_spec

PERSON = (0.5, 0.6, 1.75)
HEIGHT = 1.3
"""Of the camera above the ground [m]."""


def spec(**changes: Any) -> PhysicalCamera:
    """Return a camera 1.3 m above the ground with an angle of view of 50 degrees."""
    mount = {"z": f"{HEIGHT} m"} | changes.pop("mount", {})
    made: PhysicalCamera = sensor_spec(
        "camera/physical", **({"field_of_view": "50 deg", "mount": mount} | changes)
    )
    return made


def focal(record: PhysicalCamera) -> float:
    """Focal length [pixels]."""
    return float(0.5 * record.columns / np.tan(0.5 * record.field_of_view))


def camera(context: SceneContext, **changes: Any) -> PhysicalCameraSensor:
    return PhysicalCameraSensor(sensor_context(spec(**changes), context))


def look(context: SceneContext, shown: Scene, **changes: Any) -> Measurement:
    """Sample one scene with one new camera."""
    return camera(context, **changes).sense(shown)


def picture(context: SceneContext, shown: Scene, **changes: Any) -> Frame:
    """Take one picture of a scene with one new camera."""
    return camera(context, **changes).frame(shown)


def pixels(frame: Frame, thing: int = 0) -> int:
    """Count the pixels that show an object."""
    return int(((frame.objects == thing) & frame.visible).sum())


CONDITIONS = ("rain", "fog_visibility", "illuminance", "transmission")


def condition(name: str, share: float) -> float:
    """Return a value of a condition, from very bad at share 0 to harmless at 1."""
    if name == "rain":
        return (1.0 - share) * 300.0 * MM_PER_HOUR
    if name == "fog_visibility":
        return float(10.0 ** (1.0 + 3.0 * share))
    if name == "illuminance":
        return float(10.0 ** (-1.0 + 5.3 * share))
    return share
