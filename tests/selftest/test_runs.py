"""Masters in what drives, and in what is kept and told."""

from contextlib import nullcontext
from pathlib import Path

import pytest

from adeye.cli.app import main
from adeye.errors import AdeyeError
from adeye.selftest.bench import Bench, is_good
from adeye.selftest.running import choose
from adeye.selftest.runs import DATABASE

# --- channels, sensors, switches and monitors: the flaw shows by the FSR that is stated


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "fsr"),
    [
        ("sensor_late", "FSR-06"),
        ("oscillates", "FSR-04"),
        ("brakes_late", "FSR-02"),
        ("steers_off", "FSR-03"),
        ("switch_late", "FSR-12"),
        ("switch_debounce", "FSR-12"),
        ("switch_chatter", "FSR-13"),
        ("monitors_frozen", "FSR-14"),
    ],
)
def test_flaw_without_contact_shows_by_its_own_fsr(bench: Bench, name: str, fsr: str) -> None:
    (master,) = choose([name])
    *verdicts, _ = master.examine(bench).text.splitlines()
    assert [line for line in verdicts if not line.endswith("PASS")] == [f"{fsr} FAIL"]


# --- databases: a command says the same, and output onto one is found


@pytest.mark.slow
def test_command_agrees(bench: Bench, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    edited = DATABASE[0]
    seen = edited.examine(bench)
    assert main(["db", "verify", "--db", str(tmp_path / "altered.db")]) == seen.exit_code == 4
    assert capfd.readouterr().out.splitlines() == seen.text.splitlines()
    assert edited.twin(bench).exit_code == 0
    assert main(["db", "verify", "--db", str(tmp_path / "altered.db")]) == 0


@pytest.mark.slow
def test_output_onto_the_database(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
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
