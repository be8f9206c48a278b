"""Kept traces: files that hold what they should, and what becomes of them."""

from __future__ import annotations

import hashlib
import json
import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.campaign import traces as keeping
from adeye.campaign.replay import recorded
from adeye.campaign.run import run_campaign
from adeye.campaign.traces import altered_files, left_files, read_kept
from adeye.campaign.work import WorkContext
from adeye.errors import IntegrityError
from adeye.store.evidence.roots import SUFFIX, folder_of
from adeye.store.repository import Repository
from adeye.trace import COLUMNS, Trace
from tests.project import Project
from tests.refusals import refused
from tests.stored import known

# --- kept traces that were altered, taken away or put there


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
    for path in set(folder.iterdir()) - before.keys():
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


# --- the signals of one run: from its kept trace, else executed again


def test_recorded_signals_are_those_of_the_kept_file_and_of_an_execution(
    repository: Repository,
) -> None:
    ((name, ((result, _), *_)), *_) = repository.evidence.kept_files().items()
    run = repository.find_run(result)
    kept = recorded(repository, run)
    (folder_of(repository.location.beside) / f"{name}{SUFFIX}").unlink()
    again = recorded(repository, run)
    assert (kept.is_kept, again.is_kept) == (True, False)
    assert list(kept.signals.dictionary) == list(again.signals.dictionary)
    rows = int(kept.signals.trace.length[0])
    for signal in kept.signals.dictionary:
        one, other = (item.signals.series(signal) for item in (kept, again))
        np.testing.assert_array_equal(one.values[:, :rows], other.values[:, :rows])
        np.testing.assert_array_equal(known(one.status)[:, :rows], known(other.status)[:, :rows])


@pytest.mark.parametrize("is_readable", [True, False])
def test_altered_file_gives_no_signals(repository: Repository, *, is_readable: bool) -> None:
    ((name, ((result, _), *_)), *_) = repository.evidence.kept_files().items()
    path = folder_of(repository.location.beside) / f"{name}{SUFFIX}"
    if is_readable:
        with np.load(path) as stored:
            arrays = dict(stored)
        arrays["ego"] = arrays["ego"] + 1.0
        np.savez(path, **arrays)
    else:
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 1
        path.write_bytes(content)
    refused(IntegrityError, recorded, repository, repository.find_run(result), says="was recorded")


def test_run_that_comes_out_in_another_way_gives_no_signals(
    repository: Repository, monkeypatch: pytest.MonkeyPatch
) -> None:
    ((_, ((result, _), *_)), *_) = repository.evidence.kept_files().items()
    for path in files(repository):
        path.unlink()
    drive = WorkContext.drive

    def drift(*asked: Any, **how: Any) -> Trace:
        trace = drive(*asked, **how)
        trace.columns["ego"][:, 1] += 1e-9
        return trace

    monkeypatch.setattr(WorkContext, "drive", drift)
    refused(
        IntegrityError, recorded, repository, repository.find_run(result), says="does not come out"
    )


# --- what is not a file of traces any more is not read as one; see ``test_rejudging``


RUNS, TICKS = 2, 3
NAME = "a" * 64
EMPTY = [name for name in COLUMNS if name not in {"ego", "contact"}]


def arrays_of(**changed: Any) -> dict[str, Any]:
    """Make what a file of two runs of three ticks holds, with other arrays or none."""
    meta = {
        "monitors": ["headway"],
        "faults": [],
        "cases": ["a" * 64, "b" * 64],
        "empty": {name: ["<f8", RUNS, TICKS, 4] for name in EMPTY},
    }
    meta |= changed.pop("meta", {})
    arrays: dict[str, Any] = {
        "length": np.full(RUNS, TICKS),
        "horizon_row": np.full(RUNS, TICKS),
        "complete": np.ones(RUNS, dtype=bool),
        "time": np.arange(TICKS) * 0.1,
        "ego": np.ones((RUNS, TICKS, 7)),
        "contact": np.ones((RUNS, TICKS)),
        "meta": np.frombuffer(json.dumps(meta).encode(), dtype=np.uint8),
    }
    return {name: array for name, array in (arrays | changed).items() if array is not None}


def test_only_right_files_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert read_kept(tmp_path, NAME) is None
    path = tmp_path / f"{NAME}.npz"
    path.write_bytes(b"PK\x03\x04 too short")
    assert read_kept(tmp_path, NAME) is None
    np.savez(path, ego=np.zeros(3))
    assert read_kept(tmp_path, NAME) is None
    np.savez(path, **arrays_of())
    kept = known(read_kept(tmp_path, NAME))
    assert kept.arrays.keys() == {*COLUMNS, "time", "length", "horizon_row", "complete"}
    assert kept.arrays["authority"].shape == (RUNS, TICKS, 4)
    with monkeypatch.context() as patched:
        # It is larger than a block can be.
        patched.setattr(keeping, "MOST_BYTES", 3_000)
        assert read_kept(tmp_path, NAME) is None
    # A few kilobytes of a packed one may hold gigabytes of zeros.
    np.savez_compressed(path, **arrays_of())
    assert read_kept(tmp_path, NAME) is None


def empty(shape: Any) -> dict[str, Any]:
    return {"meta": {"empty": dict.fromkeys(EMPTY, shape)}}


OTHER_FORMS: dict[str, dict[str, Any]] = {
    "column that is missing": {"ego": None},
    "column of no trace": {"other": np.zeros((RUNS, TICKS))},
    "more ticks": {"ego": np.ones((RUNS, TICKS + 1, 7))},
    "texts": {"contact": np.array([["a"] * TICKS] * RUNS)},
    "no axis": {"length": np.array(3)},
    "fewer names than runs": {"meta": {"cases": ["a" * 64]}},
    "no names": {"meta": {"monitors": None}},
    "numbers as names": {"meta": {"faults": [1]}},
    "list for a mapping": {"meta": {"empty": []}},
    "objects": empty(["O", RUNS, TICKS]),
    "negative": empty(["<f8", -1, TICKS]),
    "text for a number": empty(["<f8", "2"]),
    "endless": empty(["<f8", RUNS, TICKS, 10**12]),
    "nested": {"meta": np.frombuffer(b"[" * 100_000, dtype=np.uint8)},
    "list as description": {"meta": np.frombuffer(b"[]", dtype=np.uint8)},
}


@pytest.mark.parametrize("form", OTHER_FORMS)
def test_other_forms_are_not_read(tmp_path: Path, form: str) -> None:
    changed = OTHER_FORMS[form]
    is_mapping = isinstance(changed.get("meta"), dict)
    arrays = arrays_of(**changed) if is_mapping else {**arrays_of(), **changed}
    there = {name: item for name, item in arrays.items() if item is not None}
    np.savez(tmp_path / f"{NAME}.npz", **there)
    assert read_kept(tmp_path, NAME) is None


def test_members_within_each_other_are_not_read(tmp_path: Path) -> None:
    """Many names for the same bytes are as good a bomb as packed ones."""
    path = tmp_path / f"{NAME}.npz"
    np.savez(path, **arrays_of())
    with zipfile.ZipFile(path, "a") as archive:
        first = archive.getinfo("ego.npy")
        for number in range(20):
            again = zipfile.ZipInfo(f"ego{number}.npy")
            again.header_offset = first.header_offset
            again.CRC, again.file_size = first.CRC, first.file_size
            again.compress_size = first.compress_size
            archive.filelist.append(again)
            archive.NameToInfo[again.filename] = again
        archive._didModify = True  # type: ignore[attr-defined]
    with zipfile.ZipFile(path) as archive:
        assert len(archive.infolist()) > 20
        assert not keeping._is_as_large_as_its_file(archive.infolist(), path.stat().st_size)
    assert read_kept(tmp_path, NAME) is None
