"""R14: every built-in channel passes one conformance suite."""

from __future__ import annotations

import pytest

from adeye.channels.nominal import NominalChannel
from adeye.channels.safety import SafetyChannel
from adeye.spec.architecture import NominalParameters, SafetyParameters
from adeye.testing import check_channel

pytestmark = pytest.mark.requirements


def test_nominal_channel_conforms() -> None:
    check_channel(NominalChannel, NominalParameters())


def test_safety_channel_conforms() -> None:
    check_channel(SafetyChannel, SafetyParameters())
