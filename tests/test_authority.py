"""Reasons keep their numbers, because stored traces hold them."""

from __future__ import annotations

from adeye import signals as authority
from adeye.signals import SwitchFaults


def test_codes_follow_the_labels() -> None:
    codes = [getattr(authority, f"REASON_{label.upper()}") for label in authority.REASON_LABELS]
    assert codes == list(range(len(authority.REASON_LABELS)))


def test_reasons_of_stored_traces_keep_their_numbers() -> None:
    stored = ("none", "default", "request", "latched", "staleness", "no_channel", "stuck")
    assert authority.REASON_LABELS[: len(stored)] == stored


def test_sound_switch_is_neither_stuck_nor_late() -> None:
    sound = SwitchFaults.none(3)
    assert sound.stuck.tolist() == [False] * 3
    assert sound.delay.tolist() == [0.0] * 3


def test_no_channel_is_no_index() -> None:
    assert authority.NO_CHANNEL < 0
