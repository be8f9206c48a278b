"""Channels, sensors, switches and monitors: the flaw shows by the FSR that is stated."""

import pytest

from adeye.selftest.bench import Bench
from adeye.selftest.driving import CHANNELS, MONITORS, SENSORS, SWITCHES
from adeye.selftest.masters import Master, is_good

FAST = [CHANNELS[0], SENSORS[1], SWITCHES[0], MONITORS[0]]
SLOW = [item for item in (*CHANNELS, *SENSORS, *SWITCHES, *MONITORS) if item not in FAST]


def check(bench: Bench, master: Master) -> None:
    seen = master.examine(bench)
    assert master.is_detected(seen), seen.text
    assert is_good(master.twin(bench))


@pytest.mark.parametrize("master", FAST, ids=lambda item: item.name)
def test_master_is_detected(bench: Bench, master: Master) -> None:
    check(bench, master)


@pytest.mark.slow
@pytest.mark.parametrize("master", SLOW, ids=lambda item: item.name)
def test_every_other_master_is_detected(bench: Bench, master: Master) -> None:
    check(bench, master)


def test_master_shows_by_its_own_fsr_and_not_by_another(bench: Bench) -> None:
    late = next(item for item in SENSORS if item.name == "sensor_late")
    verdicts = late.examine(bench).text.splitlines()[:-1]
    assert [line for line in verdicts if not line.endswith("PASS")] == ["FSR-06 FAIL"]
