"""Fakes and conformance suites for those who write channels, sensors and executors.

The product imports nothing of it. Begin with ``channels``.
"""

from adeye.testing.channels import ScriptedChannel, check_channel
from adeye.testing.driving import Drive, Fed, World, drive, feed
from adeye.testing.executors import check_executor
from adeye.testing.scenes import channel_context, passenger_car, straight_road
from adeye.testing.sensors import check_sensor

__all__ = [
    "Drive",
    "Fed",
    "ScriptedChannel",
    "World",
    "channel_context",
    "check_channel",
    "check_executor",
    "check_sensor",
    "drive",
    "feed",
    "passenger_car",
    "straight_road",
]
