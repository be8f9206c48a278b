"""What the package hands to tests of parts from outside, pinned: scenes, scripts, readings."""

import numpy as np

from adeye.testing import channel_context, channels, scenes
from adeye.testing.sensors import scene_of, three_objects
from tests.frozen import assert_frozen, described


def test_scenes_for_sensors_are_frozen() -> None:
    context = three_objects()
    lines = described(context, "context")
    for tick in (0, 1, 7, 40):
        lines += described(scene_of(context, tick), f"tick {tick}")
    assert_frozen("scenes_for_sensors.txt", "\n".join([*lines, ""]))


def test_script_for_channels_is_frozen() -> None:
    """Straight on and in a bend, with every kind of sensor and a channel beside."""
    kinds = {"pose": "localisation", "truth": "ground_truth", "camera": "camera", "radar": "radar"}
    lines = []
    for curvature in (0.0, 0.002):
        context = channel_context(
            None,
            links=[*kinds, "channels.other"],
            sensors=kinds,
            runs=3,
            road=scenes.straight_road(3, lanes=2, curvature=curvature),
            desired_speed=np.array([10.0, 20.0, 30.0]),
            every=2,
        )
        lines += described(context, f"context {curvature}")
        script = channels._script(context, kinds)
        lines.append(f"{len(script)} ticks")
        for at in (0, 1, len(script) // 2, len(script) - 6, len(script) - 5, len(script) - 1):
            lines += described(script[at], f"tick {at}")
        outage = [at for at in range(len(script)) if at in channels.OUTAGE]
        lines += described(script[outage[0]], f"first tick without, of {outage}")
    assert_frozen("script_for_channels.txt", "\n".join([*lines, ""]))


def test_readings_are_frozen() -> None:
    road = scenes.straight_road(2, curvature=-0.001)
    ego = np.array([[10.0, 5.0, 0.1, 20.0, 1.0, 0.02, 0.05], [30.0, 1.0, -0.1, 5.0, 0.0, 0.0, 0.0]])
    objects = np.zeros((2, 2, 5))
    objects[:, 0] = [40.0, 5.25, 0.0, 8.0, 0.0]
    objects[:, 1] = [25.0, 8.75, 0.3, 12.0, -1.0]
    lines = described(scenes.passenger_car().model_dump(mode="json"), "car")
    lines += described(scenes.ego_estimate(road, ego), "estimate")
    lines += described(scenes.pose_measurement(road, ego, 0.4), "pose")
    lines += described(scenes.object_measurement(ego, objects, 0.4), "objects")
    assert_frozen("readings.txt", "\n".join([*lines, ""]))
