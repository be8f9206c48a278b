"""What a manifest says, and that it notices whatever is not so any more."""

from __future__ import annotations

import json
import shutil
import sqlite3
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from adeye.errors import InputError
from adeye.report.formats.manifest import differing, fingerprint, make_manifest, read_manifest
from adeye.store.repository import Repository
from tests.store.conftest import Example

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made")
    example = Example()
    # Files of traces that were never written are no subject of these tests.
    basis = example.basis
    example.basis = lambda runs: replace(basis(runs), files=())  # type: ignore[method-assign]
    with Repository.open(folder / "a.db") as repository:
        example.campaign(repository, 4)
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    (tmp_path / "report.html").write_text("green")
    return tmp_path


@pytest.fixture
def repository(folder: Path) -> Iterator[Repository]:
    with Repository.open(folder / "a.db") as opened:
        yield opened


@pytest.fixture
def document(repository: Repository, folder: Path) -> dict[str, Any]:
    campaign = repository.find_campaign()
    content = make_manifest(repository, campaign, [folder / "report.html"], folder)
    (folder / "m.json").write_bytes(content)
    read, found = read_manifest(folder / "m.json")
    assert read == content
    assert len(fingerprint(content)) == 64
    return found


def test_untouched_evidence_is_as_it_says(
    document: dict[str, Any], folder: Path, repository: Repository
) -> None:
    assert tuple(differing(document, folder, repository)) == ()
    campaign = repository.find_campaign()
    again = make_manifest(repository, campaign, [folder / "report.html"], folder)
    assert again == (folder / "m.json").read_bytes()


def test_altered_missing_and_outlying_files_are_named(
    document: dict[str, Any], folder: Path
) -> None:
    (folder / "report.html").write_text("gree\u0274")
    assert list(differing(document, folder, None)) == ["file report.html: is altered"]
    (folder / "report.html").unlink()
    assert list(differing(document, folder, None)) == ["file report.html: is missing"]
    for name in ("../a", "/etc/hostname", "a\0b"):
        document["files"] = [{"name": name, "sha256": "0" * 64}]
        (line,) = differing(document, folder, None)
        assert "is not read" in line
    (folder / "link").symlink_to("/etc/hostname")
    document["files"] = [{"name": "link"}, "words"]
    assert len(list(differing(document, folder, None))) == 2


@pytest.mark.parametrize(
    ("statement", "named"),
    [
        ("UPDATE verdict SET margin = 9 WHERE run_number = 1", "verdict"),
        ("UPDATE metric SET min_distance_m = 9 WHERE run_number = 1", "metric"),
        ("DELETE FROM timing WHERE run_number = 1", "table timing"),
        ("DELETE FROM event WHERE run_number = 1", "table event"),
    ],
)
def test_altered_rows_are_named(
    document: dict[str, Any], folder: Path, repository: Repository, statement: str, named: str
) -> None:
    with sqlite3.connect(folder / "a.db") as raw:
        found = raw.execute("SELECT name, sql FROM sqlite_master WHERE type = 'trigger'").fetchall()
        for name, _ in found:
            raw.execute(f"DROP TRIGGER {name}")
        raw.execute(statement)
        for _, sql in found:
            raw.execute(sql)
    raw.close()
    assert any(line.startswith(named) for line in differing(document, folder, repository))


def test_result_withdrawn_since_is_named(
    document: dict[str, Any], folder: Path, repository: Repository
) -> None:
    run = repository.find_run("0", campaign=document["campaign"]).result_digest
    repository.evidence.withdraw(run, author="me", reason="map")
    assert list(differing(document, folder, repository)) == [f"run {run}: was withdrawn since"]
    document["withdrawn"] = [run, "f" * 64]
    (line,) = differing(document, folder, repository)
    assert "is not withdrawn any more" in line


def test_campaign_and_traces_have_to_be_there(
    document: dict[str, Any], folder: Path, repository: Repository
) -> None:
    document["traces"] = [{"name": "x.npz", "sha256": "0" * 64}]
    assert list(differing(document, folder, repository)) == ["trace x.npz: is missing"]
    document["campaign"] = "f" * 32
    (line,) = differing(document, folder, repository)
    assert "is not in the database" in line


def test_unfinished_campaign_is_not_signed(tmp_path: Path) -> None:
    with Repository.open(tmp_path / "b.db") as repository:
        example = Example()
        repository.plan_campaign(example.record(), example.cases(4))
        with pytest.raises(InputError, match="no evidence to sign"):
            make_manifest(repository, repository.find_campaign(), [], tmp_path)


def test_file_elsewhere_or_missing_is_refused(repository: Repository, folder: Path) -> None:
    campaign = repository.find_campaign()
    with pytest.raises(InputError, match="where the manifest is written"):
        make_manifest(repository, campaign, [folder / "report.html"], folder / "deeper")
    with pytest.raises(InputError, match="cannot be read"):
        make_manifest(repository, campaign, [folder / "none.html"], folder)


@pytest.mark.parametrize("text", ["", "[", "[]", "{}", "[" * 5000, "9" * 5000])
def test_what_is_no_manifest_is_an_input_error(tmp_path: Path, text: str) -> None:
    (tmp_path / "m.json").write_text(text)
    with pytest.raises(InputError, match=r"m\.json"):
        read_manifest(tmp_path / "m.json")


def test_manifest_with_other_types_is_an_input_error(
    document: dict[str, Any], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "m.json").write_text(json.dumps({**document, "files": {}}))
    with pytest.raises(InputError, match="is not a manifest"):
        read_manifest(folder / "m.json")
    monkeypatch.setattr("adeye.report.formats.manifest.MAX_BYTES", 10)
    with pytest.raises(InputError, match="more than 10 bytes"):
        read_manifest(folder / "m.json")
    with pytest.raises(InputError, match="cannot be read"):
        read_manifest(folder / "none.json")
