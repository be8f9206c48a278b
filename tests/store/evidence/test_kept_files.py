from __future__ import annotations

import hashlib
import os
from pathlib import Path

import pytest

from adeye.store.evidence.roots import (
    SUFFIX,
    content_name,
    find_kept,
    folder_of,
    folders_of,
    kept_path,
)

NAME = "0123456789abcdef" * 4
PARTS = (
    *("..", ".", "", "\\", "..\\", "~", "-", "%2e%2e", "\x00", "\n", "\x1b[2J", "\u202e", "\udc80"),
    *("\uff0e\uff0e", "$HOME", "CON", "C:", "file:", NAME, NAME[:-1], NAME.upper(), "outside", "é"),
    *("a" * 300, "*", "?", " ", "`id`", ";id", "\r", SUFFIX),
)
NAMES = {f"{first}{between}{last}" for first in PARTS for last in PARTS for between in ("", "/")}
NAMES -= {NAME}


def test_file_is_named_after_its_content(tmp_path: Path) -> None:
    path = tmp_path / f"a{SUFFIX}"
    path.write_bytes(b"traces")
    assert content_name(path) == hashlib.sha256(b"traces").hexdigest()
    path.write_bytes(b"traceS")
    assert content_name(path) != hashlib.sha256(b"traces").hexdigest()


def test_folder_is_beside_the_database() -> None:
    assert folder_of(Path("x/y.db")) == Path("x/y.db.traces")


@pytest.mark.parametrize("pair", [("nightly.24", "nightly.25"), ("a.db", "a.sqlite"), ("a", "a.b")])
def test_two_databases_have_a_folder_each(pair: tuple[str, str]) -> None:
    one, other = (folder_of(Path(name)) for name in pair)
    assert one != other


@pytest.mark.parametrize("folder", ["x.db.traces", "x.traces", "before.db.traces"])
def test_file_is_found_where_it_was_written(tmp_path: Path, folder: str) -> None:
    """In the folder of the database, that of earlier releases, or that of its former name."""
    (tmp_path / folder).mkdir()
    file = tmp_path / folder / f"{NAME}{SUFFIX}"
    file.write_bytes(b"traces")
    assert find_kept(folders_of(tmp_path / "x.db"), NAME) == file
    link = tmp_path / "elsewhere" / "y.db"
    link.parent.mkdir()
    (tmp_path / "x.db").touch()
    link.symlink_to(tmp_path / "x.db")
    assert folder_of(link) == tmp_path / "x.db.traces"
    assert find_kept(folders_of(link), NAME) == file


def test_no_name_leads_to_another_place(tmp_path: Path) -> None:
    """A file stands wherever a name leads to, inside or outside of the folder."""
    folder = tmp_path / "inside" / "a.traces"
    folder.mkdir(parents=True)
    planted = 0
    for name in sorted(NAMES):
        try:
            path = Path(os.path.normpath(f"{folder}/{name}{SUFFIX}"))
            if path.is_relative_to(tmp_path):
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(b"planted")
                planted += 1
        except (OSError, ValueError):
            pass
        assert kept_path(folder, name) is None, name
    assert len(NAMES) > 1_000
    assert planted > 500
    (folder / f"{NAME}{SUFFIX}").write_bytes(b"traces")
    assert kept_path(folder, NAME) == folder / f"{NAME}{SUFFIX}"


@pytest.mark.parametrize("kind", ["link", "folder", "pipe"])
def test_only_a_file_of_its_own_is_one(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"{NAME}{SUFFIX}"
    if kind == "link":
        (tmp_path / "elsewhere").write_bytes(b"traces")
        path.symlink_to(tmp_path / "elsewhere")
    elif kind == "folder":
        path.mkdir()
    else:
        os.mkfifo(path)
    assert kept_path(tmp_path, NAME) is None
