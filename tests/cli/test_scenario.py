"""``scenario``: the catalogue, and what is found in its files."""

import shutil
from pathlib import Path
from typing import Any

import pytest

from adeye.errors import UsageError
from adeye.spec.load import catalogue_files, catalogue_folder, scenario_files, shipped

# --- ``scenario list|show|lint`` on the shipped catalogue and on broken files


CUT_IN = scenario_files(shipped("scenarios_db"))["cut_in"]


@pytest.fixture
def cut_in(folder: Path) -> Path:
    """Copy a scenario to change it."""
    return Path(shutil.copy(CUT_IN, folder / "my_cut_in.yaml")).relative_to(folder)


def replace_in(path: Path, old: str, new: str) -> None:
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def test_list_shows_the_shipped_catalogue_or_another(adeye: Any, cut_in: Path) -> None:
    out = adeye("scenario", "list").out
    for part in ("cut_in", "Cut-in of a slower vehicle", "friction 0.3 to 1"):
        assert part in out
    document = adeye("scenario", "list", "--json").document
    entries = {entry["id"]: entry for entry in document["scenarios"]}
    assert entries["cut_in"]["parameters"]["gap"]["range"] == ["0 m", "60 m"]
    assert entries["cut_in"]["tags"]["r157"] == "4.4.1"
    document = adeye("scenario", "list", "--catalogue", ".", "--json").document
    assert [entry["id"] for entry in document["scenarios"]] == [cut_in.stem]


def test_list_in_a_pipe_is_bounded_and_counts_what_it_leaves_out(
    adeye: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    lines = adeye("scenario", "list").out.splitlines()
    assert max(map(len, lines)) < 260
    (row,) = [line for line in lines if line.startswith(" cut_in ")]
    assert row.endswith(" more")
    assert lines[-1] == "All parameters of one:  adeye scenario show ID"


def test_list_shows_tags_of_ones_own(adeye: Any, cut_in: Path) -> None:
    replace_in(cut_in, "tags: {", "tags: {team: planning, ")
    assert "team: planning" in adeye("scenario", "list", "--catalogue", ".").out
    entry = adeye("scenario", "list", "--catalogue", ".", "--json").document["scenarios"][0]
    assert entry["tags"]["team"] == "planning"


def test_show_has_parameters_actors_and_storyboard(adeye: Any) -> None:
    out = adeye("scenario", "show", "cut_in").out
    for part in ("gap", "30 m", "cutter", "scripted", "lane_change", "cutter.gap <= gap", "R157"):
        assert part in out
    document = adeye("scenario", "show", "cut_in", "--json").document
    assert document["content"]["scenario"] == "cut_in"
    assert "Did you mean 'cut_in'?" in adeye("scenario", "show", "cut_inn").refused


@pytest.mark.slow
def test_shipped_catalogue_lints_clean(adeye: Any) -> None:
    ended = adeye("scenario", "lint", str(shipped("scenarios_db")))
    assert (ended.code, ended.out) == (0, "")
    assert ", 0 findings" in ended.err


@pytest.mark.parametrize(
    ("old", "new", "part"),
    [
        ("horizon: 12 s", "horizon: 12 m", "horizon"),
        ("title:", "heading:", "heading"),
        ("realised: [cut_in]", "realised: [cut_out]", "cut_out"),
    ],
)
def test_finding_has_its_place(adeye: Any, cut_in: Path, old: str, new: str, part: str) -> None:
    replace_in(cut_in, old, new)
    ended = adeye("scenario", "lint", str(cut_in))
    assert ended.code == 2
    line = next(line for line in ended.out.splitlines() if part in line)
    assert line.split(": ")[0].endswith("Error")
    assert line.split(": ")[1].startswith("my_cut_in.yaml:")


def test_one_broken_file_does_not_hide_another(adeye: Any, cut_in: Path, folder: Path) -> None:
    other = Path(shutil.copy(cut_in, "other.yaml"))
    replace_in(cut_in, "realised: [cut_in]", "realised: [cut_out]")
    other.write_text("a: [", encoding="utf-8")
    ended = adeye("scenario", "lint", ".", "--json")
    assert ended.code == 2
    document = ended.document
    assert document["files"] == ["my_cut_in.yaml", "other.yaml"]
    assert {finding["where"]["path"] for finding in document["findings"]} == set(document["files"])
    (folder / "empty").mkdir()
    assert adeye("scenario", "lint", "empty").code == 2


def test_lint_asks_what_must_begin_and_what_nothing_uses(adeye: Any, cut_in: Path) -> None:
    replace_in(cut_in, "    optional: true\n", "")
    replace_in(cut_in, "parameters:\n", "parameters:\n  shade: {default: 1}\n")
    ended = adeye("scenario", "lint", str(cut_in))
    assert ended.code == 2
    assert "event 'change_speed' need not begin" in ended.out
    assert "nothing that happens depends on parameter 'shade'" in ended.out
    assert ended.out.count("my_cut_in.yaml:") == 2


# --- which catalogue is read


def test_catalogue_is_the_chosen_one_else_that_of_here_else_the_shipped(folder: Path) -> None:
    assert catalogue_folder(None) == shipped("scenarios_db")
    (folder / "scenarios_db").mkdir()
    assert catalogue_folder(None) == Path("scenarios_db")
    assert catalogue_folder(folder) == folder
    with pytest.raises(UsageError, match="not a folder"):
        catalogue_folder(folder / "none")


def test_scenarios_here_stand_beside_the_shipped_ones_and_before_them(folder: Path) -> None:
    here = folder / "scenarios_db"
    here.mkdir()
    for name in ("cut_in", "mine"):
        (here / f"{name}.yaml").write_text("")
    found = catalogue_files(None)
    assert found["cut_in"] == Path("scenarios_db/cut_in.yaml")
    assert found["mine"] == Path("scenarios_db/mine.yaml")
    assert found["lead_braking"].is_relative_to(shipped("scenarios_db"))
    assert set(catalogue_files(here)) == {"cut_in", "mine"}
