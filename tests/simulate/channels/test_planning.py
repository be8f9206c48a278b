import math

from adeye.simulate.channels.nominal import RELEASE, is_emergency

THRESHOLD = 3.5


def test_emergency_begins_at_the_threshold_and_not_below() -> None:
    assert is_emergency(was=False, required=THRESHOLD, threshold=THRESHOLD)
    assert not is_emergency(was=False, required=THRESHOLD - 1e-9, threshold=THRESHOLD)


def test_emergency_goes_on_until_the_threat_is_gone() -> None:
    assert is_emergency(was=True, required=0.5 * THRESHOLD, threshold=THRESHOLD)
    assert not is_emergency(was=True, required=RELEASE * THRESHOLD, threshold=THRESHOLD)
    assert not is_emergency(was=True, required=0.0, threshold=THRESHOLD)


def test_contact_ahead_is_an_emergency() -> None:
    assert is_emergency(was=False, required=math.inf, threshold=THRESHOLD)
