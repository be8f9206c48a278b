"""The channels of an architecture, built for a batch and called together at every tick."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from adeye.channels import make_channel
from adeye.channels.clock import ClockedChannel
from adeye.channels.guard import GuardedChannel
from adeye.channels.links import observe
from adeye.ports import ChannelContext
from adeye.sensors.rig import mounts
from adeye.signals import Authority, ControlCommand, Measurement, Scene, SceneContext
from adeye.spec.clock import period_ticks, ticks
from adeye.sweep.case import TestCase
from adeye.trace import ChannelEvent
