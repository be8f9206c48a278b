"""Databases and reports: every alteration is found, an unaltered copy is accepted."""

from contextlib import nullcontext
from pathlib import Path

import pytest

from adeye.cli.app import main
from adeye.errors import AdeyeError
from adeye.selftest.bench import Bench, Master, is_good
from adeye.selftest.runs import DATABASE, REPORT


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
