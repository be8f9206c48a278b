"""R14: every built-in channel passes one conformance suite."""

from __future__ import annotations

import pytest

from adeye.channels.nominal import NominalChannel
from adeye.channels.safety import SafetyChannel
from adeye.testing import check_channel

pytestmark = pytest.mark.requirements


@pytest.mark.parametrize("channel", [NominalChannel, SafetyChannel])
def test_channel_conforms(channel: type[NominalChannel | SafetyChannel]) -> None:
    check_channel(channel)
