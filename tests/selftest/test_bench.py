"""The bench: good as it is, edits that apply exactly once, and the user's files left alone."""

from pathlib import Path

import pytest

from adeye.selftest.bench import BARE, DB, DRIVING, HANDOVER, Bench, Edit


@pytest.mark.slow
@pytest.mark.parametrize("odd", [DRIVING, HANDOVER])
def test_bench_is_good_as_it_is(bench: Bench, odd: str) -> None:
    seen = bench.run((), odd)
    assert seen.exit_code == 0, seen.text
    assert "FAIL" not in seen.text
    assert "PASS" in seen.text


def test_error_is_seen_as_the_command_would_show_it(bench: Bench) -> None:
    seen = bench.run((Edit(BARE, "range: 150 m", "range: 150"),))
    assert seen.exit_code == 2
    assert f"{BARE}:19:12" in seen.text


@pytest.mark.parametrize("old", ["no such text", "rate: 20 Hz"])
def test_edit_that_does_not_apply_once_is_refused(bench: Bench, old: str) -> None:
    with pytest.raises(ValueError, match="times, not once"):
        bench.settle((Edit(BARE, old, "x"),))


@pytest.mark.slow
def test_same_edits_are_executed_once(bench: Bench) -> None:
    edit = (Edit(BARE, "range: 150 m", "range: 120 m"),)
    assert bench.run(edit) is bench.run(edit)
    assert bench.settle(edit) == bench.settle(edit) != bench.settle(())


@pytest.mark.slow
def test_nothing_outside_of_its_folder_is_written(
    bench: Bench, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = tmp_path_factory.mktemp("here")
    monkeypatch.chdir(here)
    monkeypatch.setenv("ADEYE_DB", str(here / "mine.db"))
    bench.run(())
    assert list(here.iterdir()) == []
    assert (bench.settle(()) / DB).is_file()
    assert Path(bench.folder) != here
