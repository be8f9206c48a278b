"""``new``: writes a file once, and says how to use it."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from adeye.cli.new import class_name

KINDS = ("channel", "sensor", "metric")


@pytest.mark.parametrize("kind", KINDS)
def test_file_is_written_and_its_use_printed(adeye: Any, folder: Path, kind: str) -> None:
    ended = adeye("new", kind, "lane_keeper", "--path", "parts/mine")
    assert ended.code == 0, ended.err
    assert ended.err == "wrote parts/mine/lane_keeper.py\n"
    assert (folder / "parts/mine/lane_keeper.py").is_file()
    assert "./lane_keeper.py:LaneKeeper" in str(yaml.safe_load(ended.out))


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_overwritten(adeye: Any, folder: Path, kind: str) -> None:
    (folder / "mine.py").write_text("precious")
    ended = adeye("new", kind, "mine")
    assert ended.code == 2
    assert "exists and is not overwritten" in ended.err
    assert (folder / "mine.py").read_text() == "precious"


@pytest.mark.parametrize("name", ["Mine", "1st", "a-b", "../a", "class", "a b", "", "x" * 65])
def test_name_that_cannot_be_one_is_refused(adeye: Any, folder: Path, name: str) -> None:
    assert adeye("new", "channel", name).code == 2
    assert list(folder.iterdir()) == []


def test_class_names() -> None:
    assert [class_name(name) for name in ("follower", "lane_keeper", "a1_b", "a__b")] == [
        "Follower",
        "LaneKeeper",
        "A1B",
        "AB",
    ]
