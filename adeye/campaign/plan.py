"""Plan a campaign: load, check everything that can be checked, count; nothing is executed."""

from __future__ import annotations

import platform
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

from adeye.channels.factory import BUILT_IN as BUILT_IN_CHANNELS
from adeye.channels.factory import plugin_channel
from adeye.engine import EngineIdentity, identity
from adeye.errors import InputErrors, SpecError
from adeye.evaluation.judge import CheckedRequirements, check_requirements
from adeye.faults.plan import check_faults
from adeye.registry import Part, load_part, plugins_digest, require, validate_parameters
from adeye.sensors.rig import BUILT_IN as BUILT_IN_SENSORS
from adeye.spec.architecture import Architecture
from adeye.spec.load import Loaded, OddFiles, load_odd
from adeye.spec.quantity import Record
from adeye.store.rows import CampaignFsr, CampaignRecord, ContentRecord, EngineKey, PlannedCase
from adeye.sweep.axes import quantity_or_text
from adeye.sweep.case import TestCase
from adeye.sweep.expand import Expansion, expand
from adeye.sweep.structure import structure_key
from adeye.units import Dimension
from adeye.world.check import check_scenario
