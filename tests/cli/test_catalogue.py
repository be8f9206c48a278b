"""Which catalogue is read."""

from pathlib import Path

import pytest

from adeye.errors import UsageError
from adeye.spec.load import catalogue_files, catalogue_folder, shipped


def test_shipped_unless_there_is_one_here(folder: Path) -> None:
    assert catalogue_folder(None) == shipped("scenarios_db")
    (folder / "scenarios_db").mkdir()
    assert catalogue_folder(None) == Path("scenarios_db")


def test_chosen_one_wins(folder: Path) -> None:
    assert catalogue_folder(folder) == folder


def test_chosen_one_must_be_a_folder(folder: Path) -> None:
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
