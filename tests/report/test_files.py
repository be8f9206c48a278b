import os
from pathlib import Path

import pytest

from adeye.errors import PlatformError
from adeye.report.files import replacing, replacing_folder, write_atomically


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


def fill(folder: Path, name: str) -> None:
    with replacing_folder(folder) as place:
        (place / name).write_text(name, "utf-8")


def test_folder_is_replaced_as_a_whole(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "out"
    fill(folder, "one")
    fill(folder, "two")
    assert [path.name for path in folder.iterdir()] == ["two"]
    assert list(folder.parent.iterdir()) == [folder]


def test_folder_that_cannot_take_its_place_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "out"
    fill(folder, "one")
    real = Path.replace

    def replace(self: Path, target: Path) -> Path:
        if self.name.endswith(".part"):
            raise OSError(28, "No space left on device")
        return real(self, target)

    monkeypatch.setattr(Path, "replace", replace)
    with pytest.raises(PlatformError, match="No space left on device"):
        fill(folder, "two")
    assert [path.name for path in folder.iterdir()] == ["one"]
    assert list(tmp_path.iterdir()) == [folder]


def test_error_while_writing_is_passed_on_and_leaves_nothing(tmp_path: Path) -> None:
    def fail(place: Path) -> None:
        (place / "file" if place.is_dir() else place).write_text("x", "utf-8")
        raise KeyError

    with pytest.raises(KeyError), replacing(tmp_path / "file") as place:
        fail(place)
    with pytest.raises(KeyError), replacing_folder(tmp_path / "folder") as place:
        fail(place)
    assert list(tmp_path.iterdir()) == []
