import os
from pathlib import Path

import pytest

from adeye.errors import PlatformError
from adeye.report.files import write_atomically


def test_file_holds_the_content_and_nothing_is_left_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b" / "report.json"
    write_atomically(b"one", path)
    write_atomically(b"two", path)
    assert path.read_bytes() == b"two"
    assert list(path.parent.iterdir()) == [path]


def test_failure_keeps_the_old_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "report.json"
    write_atomically(b"old", path)

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(PlatformError, match="No space left on device"):
        write_atomically(b"new", path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_folder_in_the_place_of_the_file_is_a_platform_error(tmp_path: Path) -> None:
    with pytest.raises(PlatformError, match="cannot write"):
        write_atomically(b"x", tmp_path)
    assert list(tmp_path.parent.glob(f".{tmp_path.name}*")) == []


def test_report_is_an_ordinary_file(tmp_path: Path) -> None:
    path, other = tmp_path / "report.json", tmp_path / "other"
    write_atomically(b"x", path)
    other.write_bytes(b"x")
    assert path.stat().st_mode == other.stat().st_mode
