"""Kept traces that were altered, taken away or put there."""

from __future__ import annotations

import hashlib
import shutil
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.campaign.run import run_campaign
from adeye.campaign.traces import altered_files, left_files
from adeye.store.evidence.roots import SUFFIX, folder_of
from adeye.store.repository import Repository
from tests.project import Project

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run a few cases and keep their traces."""
    project = Project(tmp_path_factory.mktemp("kept") / "project")
    with project.edited_odd() as odd:
        odd["scenarios"] = odd["scenarios"][:1]
    run_campaign(project.plan(), db=project.db, traces="all")
    return project.db


@pytest.fixture
def repository(kept: Path) -> Iterator[Repository]:
    folder = folder_of(kept)
    before = {path: path.read_bytes() for path in folder.iterdir()}
    with Repository.open(kept, create=False) as opened:
        yield opened
    for path in folder.iterdir():
        if path not in before:
            path.unlink()
    for path, content in before.items():
        path.write_bytes(content)


def files(repository: Repository) -> list[Path]:
    return sorted(folder_of(repository.location.beside).iterdir())


def found(repository: Repository) -> list[tuple[str, str]]:
    return [(item.row, item.problem) for item in altered_files(repository)]


def test_untouched_files_have_no_findings(repository: Repository) -> None:
    assert files(repository)
    assert (found(repository), left_files(repository)) == ([], ())


def test_every_flipped_bit_is_named(repository: Repository) -> None:
    path = files(repository)[0]
    content = path.read_bytes()
    for place in np.random.default_rng(5).integers(0, len(content), 20).tolist():
        damaged = bytearray(content)
        damaged[place] ^= 1
        path.write_bytes(damaged)
        ((name, problem),) = found(repository)
        assert name == path.name
        assert problem.startswith("is altered, which has the traces of run ")


def test_traces_of_two_databases_are_told_apart(kept: Path, tmp_path: Path) -> None:
    """One beside the other, in one folder as earlier releases had it, renamed, by a link."""
    one, other = tmp_path / "nightly.24", tmp_path / "nightly.25"
    shutil.copy(kept, one)
    shutil.copytree(folder_of(kept), tmp_path / "nightly.traces")
    (tmp_path / "nightly.traces" / f"{hashlib.sha256(b'x').hexdigest()}{SUFFIX}").write_bytes(b"x")
    Repository.open(other).close()
    (tmp_path / "below").mkdir()
    (tmp_path / "below" / "link").symlink_to(one)
    for place in (one, other, tmp_path / "below" / "link"):
        with Repository.open(place, create=False) as opened:
            assert (found(opened), left_files(opened)) == ([], ())
    one.rename(tmp_path / "renamed.db")
    with Repository.open(tmp_path / "renamed.db", create=False) as opened:
        assert found(opened) == []
    shutil.rmtree(tmp_path / "nightly.traces")
    with Repository.open(tmp_path / "renamed.db", create=False) as opened:
        (_, problem), *_ = found(opened)
    assert problem.startswith(f"is missing (bring it to {tmp_path}/renamed.db.traces from where")


def test_missing_and_foreign_files_are_named(repository: Repository) -> None:
    path = files(repository)[0]
    folder = path.parent
    path.unlink()
    (folder / "notes.txt").write_text("mine")
    (folder / f"{'0' * 64}{SUFFIX}").write_bytes(b"x")
    (folder / f"link{SUFFIX}").symlink_to("/etc/hostname")
    named = dict(found(repository))
    assert named[path.name].startswith("is missing")
    others = {name for name, problem in named.items() if "not written by adeye" in problem}
    assert others == {"notes.txt", f"{'0' * 64}{SUFFIX}", f"link{SUFFIX}"}
    (folder / f"link{SUFFIX}").unlink()


def test_what_an_interrupted_block_leaves_is_no_finding(repository: Repository) -> None:
    folder = files(repository)[0].parent
    whole = hashlib.sha256(b"x").hexdigest() + SUFFIX
    (folder / whole).write_bytes(b"x")
    (folder / "part.tmp").write_bytes(b"")
    assert found(repository) == []
    assert left_files(repository) == tuple(sorted((whole, "part.tmp")))


def test_file_named_after_its_traces_has_to_be_readable(
    repository: Repository, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = files(repository)[0]
    runs = repository.evidence.kept_files()[path.stem]
    name = hashlib.sha256(" ".join(trace for _, trace in runs).encode()).hexdigest()
    known: dict[str, Any] = {name: runs}
    monkeypatch.setattr(type(repository.evidence), "kept_files", lambda *_: known)
    other = path.rename(path.with_name(name + SUFFIX))
    assert found(repository) == []
    other.write_bytes(b"no traces")
    assert [row for row, _ in found(repository)] == [other.name]
