"""Which catalogue is read."""

from pathlib import Path

import pytest

from adeye.cli.catalogue import catalogue_folder
from adeye.errors import UsageError
from adeye.spec.load import shipped


def test_shipped_unless_there_is_one_here(folder: Path) -> None:
    assert catalogue_folder(None) == shipped("scenarios_db")
    (folder / "scenarios_db").mkdir()
    assert catalogue_folder(None) == Path("scenarios_db")


def test_chosen_one_wins(folder: Path) -> None:
    assert catalogue_folder(folder) == folder


def test_chosen_one_must_be_a_folder(folder: Path) -> None:
    with pytest.raises(UsageError, match="not a folder"):
        catalogue_folder(folder / "none")
