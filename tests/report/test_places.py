"""Lines of FSRs and scenarios, only where the files still say what was run."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from adeye.report.places import Places, places_of
from adeye.spec.load import OddFiles, load_odd, shipped


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


@pytest.mark.parametrize("broken", ["", "gone.yaml"])
def test_file_that_is_not_there_has_no_lines(path: Path, broken: str) -> None:
    files = load_odd(path)
    name = str(path.with_name(broken)) if broken else ""
    assert places_of(name, content(files), files.concept.spec) == Places()


def test_file_that_cannot_be_read_has_no_lines(path: Path) -> None:
    files = load_odd(path)
    path.write_text("odd: [", "utf-8")
    assert found(path, files) == Places()
