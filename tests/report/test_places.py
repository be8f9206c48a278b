"""Lines of FSRs and scenarios, only where the files still say what was run."""

import os
import shutil
from pathlib import Path
from typing import Any

import pytest

from adeye.report.concept import Places, places_of, uri_of
from adeye.report.model.part import Place
from adeye.spec.load import OddFiles, find_odd, load_odd, odd_of, shipped


@pytest.fixture
def path(tmp_path: Path) -> Path:
    shutil.copytree(shipped("odd"), tmp_path / "odd")
    return tmp_path / "odd" / "motorway_chauffeur.yaml"


def content(files: OddFiles) -> dict[str, Any]:
    return {"odd": files.odd.spec.model_dump(mode="json", by_alias=True)}


def found(path: Path, files: OddFiles) -> Places:
    return places_of(str(path), content(files), files.concept.spec)


def test_line_is_that_of_the_file(path: Path) -> None:
    files = load_odd(path)
    places = found(path, files)
    line = places.scenarios["cut_in"].line
    assert "use: cut_in" in path.read_text("utf-8").splitlines()[line - 1]
    place = places.fsrs["FSR-03"]
    assert "FSR-03" in Path(place.path).read_text("utf-8").splitlines()[place.line - 1]
    assert len(places.fsrs) == len(files.concept.spec.requirements)


def test_what_was_changed_since_has_no_line(path: Path) -> None:
    files = load_odd(path)
    concept = path.parent / "concepts" / "motorway_chauffeur.yaml"
    concept.write_text(concept.read_text("utf-8").replace("at_most: 6.0", "at_most: 5.0"), "utf-8")
    path.write_text(path.read_text("utf-8").replace("[30 m, 50 m]", "[30 m, 60 m]"), "utf-8")
    places = found(path, files)
    assert "FSR-02" not in places.fsrs
    assert "FSR-03" in places.fsrs
    assert "cut_in" not in places.scenarios
    assert "lead_braking" in places.scenarios


def test_file_that_is_not_there_or_cannot_be_read_has_no_lines(path: Path) -> None:
    files = load_odd(path)
    for name in ("", str(path.with_name("gone.yaml"))):
        places = places_of(name, content(files), files.concept.spec)
        assert (places.fsrs, places.scenarios) == ({}, {})
        assert (places.odd is None) is (not name)
    path.write_text("odd: [", "utf-8")
    assert found(path, files) == Places(Place(path=str(path), line=1, column=1))


@pytest.mark.parametrize("git", ["folder", "file", ""])
@pytest.mark.parametrize("place", ["", "odd", "sub/deep"])
def test_uri_is_the_same_from_every_folder_and_for_every_spelling(
    path: Path, monkeypatch: pytest.MonkeyPatch, git: str, place: str
) -> None:
    root = path.parents[1]
    here = root / place
    here.mkdir(parents=True, exist_ok=True)
    monkeypatch.chdir(here)
    if git == "folder":
        (root / ".git").mkdir()
    elif git == "file":  # of a worktree
        (root / ".git").write_text("gitdir: elsewhere")
    elif place == "odd":
        pytest.skip("nothing says where the root is")
    spellings = (str(path), os.path.relpath(path), f"./{os.path.relpath(path)}")
    assert {uri_of(name) for name in spellings} == {"odd/motorway_chauffeur.yaml"}


def test_uri_is_percent_encoded_and_never_leads_upwards(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "sub").mkdir()
    monkeypatch.chdir(tmp_path / "sub")
    assert uri_of("../my odd/ä#1:%.yaml") == "my%20odd/%C3%A4%231%3A%25.yaml"
    assert not uri_of("../../../../../../../../../../x.yaml").startswith(".")


def test_odd_is_found_from_the_folder_of_the_database(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = path.parents[1]
    (root / "sub").mkdir()
    monkeypatch.chdir(root / "sub")
    found = find_odd("odd/motorway_chauffeur.yaml", root / ".adeye")
    assert found == Path("../odd/motorway_chauffeur.yaml")
    # Another project may have such a file, too.
    (root / "sub" / "odd").mkdir()
    (root / "sub" / "odd" / "motorway_chauffeur.yaml").touch()
    assert find_odd("odd/motorway_chauffeur.yaml", root / ".adeye") == found
    assert find_odd("odd/motorway_chauffeur.yaml") == Path("odd/motorway_chauffeur.yaml")
    # Where it was goes before what looks alike on the way up.
    there = root / "sub" / "odd" / "motorway_chauffeur.yaml"
    known = {"odd_path": "odd/motorway_chauffeur.yaml", "odd_place": str(there)}
    assert odd_of(known, root / ".adeye") == Path("odd/motorway_chauffeur.yaml")
    assert odd_of({**known, "odd_place": "/gone.yaml"}, root / ".adeye") == found
    assert find_odd("odd/gone.yaml", root / ".adeye") == Path("odd/gone.yaml")
    (root / ".git").mkdir()
    assert find_odd("odd/gone.yaml", root / ".adeye") == Path("../odd/gone.yaml")


def test_odd_of_a_project_that_was_moved_is_found_though_it_was_named_whole(
    path: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    root = path.parents[1]
    gone = "/gone/before/odd/motorway_chauffeur.yaml"
    known = {"odd_path": gone, "odd_place": gone}
    monkeypatch.chdir(tmp_path.parent)
    assert odd_of(known, root / ".adeye").resolve() == path.resolve()
    assert odd_of(known, Path("/")) == Path(gone)
    # Who worked on it since names the place where it is now.
    now = {"odd_path": str(path), "odd_place": str(path)}
    assert odd_of(known, Path("/"), [known, now, known]).resolve() == path.resolve()
    # The database is elsewhere, as on a server.
    monkeypatch.chdir(root)
    assert odd_of(known, Path("/")) == Path("odd/motorway_chauffeur.yaml")
