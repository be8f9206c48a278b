"""The bench, its project without a defect, and the masters that edit it."""

from pathlib import Path

import pytest
import yaml

from adeye.selftest import bench
from adeye.selftest.bench import (
    BARE,
    DB,
    DRIVING,
    FILES,
    GROUPS,
    HANDOVER,
    PARTS,
    Bench,
    Edit,
    Master,
    Seen,
    is_good,
    running,
)
from adeye.selftest.running import MASTERS

# --- the bench: good as it is, edits that apply exactly once, and the user's files left alone


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


# --- the files of the bench: each is what its place says


def test_every_file_of_the_project_is_one_of_the_bench() -> None:
    folder = Path(bench.__file__).with_name("project")
    files = [path for path in folder.rglob("*") if path.is_file()]
    assert {path.relative_to(folder).as_posix() for path in files} == set(FILES)


def test_every_file_is_yaml_of_the_kind_of_its_folder() -> None:
    kinds = {"scenarios_db": "scenario", "architectures": "architecture", "concepts": "concept"}
    for name, text in FILES.items():
        content = yaml.safe_load(text)
        assert kinds.get(name.split("/")[-2], "odd") in content, name
        assert content[kinds.get(name.split("/")[-2], "odd")] == name.split("/")[-1][:-5]


def test_plugins_are_where_the_files_name_them() -> None:
    folders = {name.rpartition("/")[0] for name in PARTS}
    named = {name.rpartition("/")[0] for name, text in FILES.items() if "./parts.py" in text}
    assert named <= folders


# --- what counts as detected: the stated exit code together with the stated words, nothing less


@pytest.mark.parametrize(
    ("code", "text", "is_detected"),
    [
        (1, "FSR-01 FAIL\nFSR-02 PASS", True),
        (0, "FSR-01 FAIL", False),
        (3, "FSR-01 FAIL", False),
        (-1, "FSR-01 FAIL", False),
        (1, "FSR-02 FAIL", False),
        (1, "", False),
    ],
)
def test_exit_code_and_words_are_both_needed(code: int, text: str, *, is_detected: bool) -> None:
    master = Master("m", "channel", "w", "f", 1, "FSR-01 FAIL", running(), running())
    assert master.is_detected(Seen(code, text)) is is_detected


def test_only_exit_code_0_is_good() -> None:
    assert [code for code in (-1, 0, 1, 2, 3, 4, 5) if is_good(Seen(code, ""))] == [0]


@pytest.mark.slow
def test_edits_are_taken_through_the_production_path(bench: Bench) -> None:
    assert running(Edit(BARE, "flaw: none", "flaw: never_brakes"))(bench).exit_code == 1


def test_masters_have_names_of_their_own_and_say_how_they_show() -> None:
    assert len({master.name for master in MASTERS}) == len(MASTERS) >= 30
    assert {master.group for master in MASTERS} == set(GROUPS)
    for master in MASTERS:
        assert master.exit_code in {1, 2, 3, 4}
        assert min(map(len, (master.wrong, master.finder, master.words))) > 5, master.name
