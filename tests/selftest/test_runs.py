"""Masters in what drives, and in what is kept and told."""

from contextlib import nullcontext
from pathlib import Path

import pytest

from adeye.cli.app import main
from adeye.errors import AdeyeError
from adeye.selftest.bench import Bench, Master, is_good
from adeye.selftest.runs import CHANNELS, DATABASE, MONITORS, REPORT, SENSORS, SWITCHES

# --- channels, sensors, switches and monitors: the flaw shows by the FSR that is stated


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


# --- databases and reports: every alteration is found, an unaltered copy is accepted


@pytest.mark.slow
@pytest.mark.parametrize("master", [*DATABASE, *REPORT], ids=lambda item: item.name)
def test_alteration_is_found(bench: Bench, master: Master) -> None:
    seen = master.examine(bench)
    assert master.is_detected(seen), seen.text
    twin = master.twin(bench)
    assert is_good(twin), twin.text


@pytest.mark.slow
def test_command_says_what_the_master_sees(
    bench: Bench, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    edited = DATABASE[0]
    seen = edited.examine(bench)
    assert main(["db", "verify", "--db", str(tmp_path / "altered.db")]) == seen.exit_code == 4
    assert capfd.readouterr().out.splitlines() == seen.text.splitlines()
    assert edited.twin(bench).exit_code == 0
    assert main(["db", "verify", "--db", str(tmp_path / "altered.db")]) == 0


@pytest.mark.slow
@pytest.mark.parametrize("master", REPORT[:2], ids=lambda item: item.name)
def test_flipped_report_is_found(bench: Bench, master: Master) -> None:
    assert master.is_detected(master.examine(bench))
    assert is_good(master.twin(bench))


@pytest.mark.slow
def test_output_onto_the_database_is_found_and_harms_nothing(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    master = next(item for item in DATABASE if item.name == "output_onto_database")
    assert master.is_detected(master.examine(bench))
    assert is_good(master.twin(bench))
    # A tool without the guard is found out.
    monkeypatch.setattr("adeye.reporting.guarding", lambda *_: nullcontext())
    monkeypatch.setattr("adeye.outputs.require_replaceable", lambda *_: None)
    monkeypatch.setattr(
        "adeye.reporting.write_atomically", lambda data, path: path.write_bytes(data)
    )
    with pytest.raises(AdeyeError):
        master.examine(bench)
