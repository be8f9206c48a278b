"""Channels, sensors, switches and monitors: the flaw shows by the FSR that is stated."""

import pytest

from adeye.selftest.bench import Bench, Master, is_good
from adeye.selftest.runs import CHANNELS, MONITORS, SENSORS, SWITCHES

FAST = [CHANNELS[0], SENSORS[1], SWITCHES[0], MONITORS[0]]
SLOW = [item for item in (*CHANNELS, *SENSORS, *SWITCHES, *MONITORS) if item not in FAST]


def check(bench: Bench, master: Master) -> None:
    seen = master.examine(bench)
    assert master.is_detected(seen), seen.text
    assert is_good(master.twin(bench))


@pytest.mark.slow
@pytest.mark.parametrize("master", FAST, ids=lambda item: item.name)
def test_master_is_detected(bench: Bench, master: Master) -> None:
    check(bench, master)


@pytest.mark.slow
@pytest.mark.parametrize("master", SLOW, ids=lambda item: item.name)
def test_every_other_master_is_detected(bench: Bench, master: Master) -> None:
    check(bench, master)


def only(bench: Bench, name: str, fsr: str) -> None:
    (master,) = (item for item in (*FAST, *SLOW) if item.name == name)
    *verdicts, _ = master.examine(bench).text.splitlines()
    assert [line for line in verdicts if not line.endswith("PASS")] == [f"{fsr} FAIL"]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "fsr"), [("sensor_late", "FSR-06"), ("oscillates", "FSR-04")])
def test_master_shows_by_its_own_fsr_and_not_by_another(bench: Bench, name: str, fsr: str) -> None:
    only(bench, name, fsr)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "fsr"),
    [
        ("brakes_late", "FSR-02"),
        ("steers_off", "FSR-03"),
        ("switch_late", "FSR-12"),
        ("switch_debounce", "FSR-12"),
        ("switch_chatter", "FSR-13"),
        ("monitors_frozen", "FSR-14"),
    ],
)
def test_every_other_flaw_without_contact_shows_by_its_own_fsr(
    bench: Bench, name: str, fsr: str
) -> None:
    only(bench, name, fsr)
