"""Manifests: what is signed, and how an altered file is told."""

import base64
import json
import os
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from adeye.errors import InputError, IntegrityError, PlatformError, UsageError
from adeye.report.formats import manifest
from adeye.store.evidence.roots import CertificateRecord
from adeye.store.repository import Repository
from tests.refusals import refused
from tests.sql import alter
from tests.store.conftest import Example


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
    content = manifest.make_manifest(repository, campaign, [folder / "report.html"], folder)
    (folder / "m.json").write_bytes(content)
    read, found = manifest.read_manifest(folder / "m.json")
    assert read == content
    assert len(manifest.fingerprint(content)) == 64
    return found


def test_untouched_evidence_is_as_it_says(
    document: dict[str, Any], folder: Path, repository: Repository
) -> None:
    assert tuple(manifest.differing(document, folder, repository)) == ()
    campaign = repository.find_campaign()
    again = manifest.make_manifest(repository, campaign, [folder / "report.html"], folder)
    assert again == (folder / "m.json").read_bytes()


def test_altered_missing_and_outlying_files_are_named(
    document: dict[str, Any], folder: Path
) -> None:
    (folder / "report.html").write_text("gree\u0274")
    assert list(manifest.differing(document, folder, None)) == ["file report.html: is altered"]
    (folder / "report.html").unlink()
    assert list(manifest.differing(document, folder, None)) == ["file report.html: is missing"]
    for name in ("../a", "/etc/hostname", "a\0b"):
        document["files"] = [{"name": name, "sha256": "0" * 64}]
        (line,) = manifest.differing(document, folder, None)
        assert "is not read" in line
    (folder / "link").symlink_to("/etc/hostname")
    document["files"] = [{"name": "link"}, "words"]
    assert len(list(manifest.differing(document, folder, None))) == 2


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
    alter(folder / "a.db", statement)
    assert any(line.startswith(named) for line in manifest.differing(document, folder, repository))


def test_result_withdrawn_since_is_named(
    document: dict[str, Any], folder: Path, repository: Repository
) -> None:
    run = repository.find_run("0", campaign=document["campaign"]).result_digest
    repository.evidence.withdraw(run, author="me", reason="map")
    assert list(manifest.differing(document, folder, repository)) == [
        f"run {run}: was withdrawn since"
    ]
    document["withdrawn"] = [run, "f" * 64]
    (line,) = manifest.differing(document, folder, repository)
    assert "is not withdrawn any more" in line


def test_result_that_came_out_otherwise_is_named_before_and_after(
    document: dict[str, Any], folder: Path, repository: Repository
) -> None:
    campaign = repository.find_campaign(document["campaign"])
    run = repository.find_run("0", campaign=campaign.id).result_digest
    assert document["not_certified"] == []
    findings = [{"run": run, "conditions": []}]
    found = CertificateRecord(campaign.id, "1", "portable", 4, 3, 3, 0, [], findings)
    repository.hindsight.certificates.save(found)
    assert list(manifest.differing(document, folder, repository)) == [
        f"run {run}: came out otherwise for a certificate since"
    ]
    now = json.loads(manifest.make_manifest(repository, campaign, (), folder))
    assert now["not_certified"] == [run]
    # As on a copy from before.
    now["not_certified"] += ["f" * 64]
    (line,) = manifest.differing(now, folder, repository)
    assert (
        line == f"run {'f' * 64}: came out otherwise for a certificate that is not in the database"
    )


def test_campaign_and_traces_have_to_be_there(
    document: dict[str, Any], folder: Path, repository: Repository
) -> None:
    document["traces"] = [{"name": "x.npz", "sha256": "0" * 64}]
    assert list(manifest.differing(document, folder, repository)) == ["trace x.npz: is missing"]
    document |= {"traces": [], "odd": "another"}
    (line,) = manifest.differing(document, folder, repository)
    assert "not of another" in line
    document["campaign"] = "f" * 32
    (line,) = manifest.differing(document, folder, repository)
    assert "is not in the database" in line


def test_manifest_with_which_nothing_would_be_compared_is_refused(
    document: dict[str, Any], folder: Path
) -> None:
    assert list(manifest.differing(document, folder, None)) == []
    document["files"] = []
    refused(UsageError, list, manifest.differing(document, folder, None), says="names no files")


def test_unfinished_campaign_is_not_signed(tmp_path: Path) -> None:
    with Repository.open(tmp_path / "b.db") as repository:
        example = Example()
        repository.plan_campaign(example.record(), example.cases(4))
        with pytest.raises(InputError, match="no evidence to sign"):
            manifest.make_manifest(repository, repository.find_campaign(), [], tmp_path)


def test_file_elsewhere_or_missing_is_refused(repository: Repository, folder: Path) -> None:
    campaign = repository.find_campaign()
    with pytest.raises(InputError, match="where the manifest is written"):
        manifest.make_manifest(repository, campaign, [folder / "report.html"], folder / "deeper")
    with pytest.raises(InputError, match="cannot be read"):
        manifest.make_manifest(repository, campaign, [folder / "none.html"], folder)


def test_link_is_named_as_it_is_given_and_a_pipe_is_refused(
    repository: Repository, folder: Path
) -> None:
    (folder / "given.txt").symlink_to("report.html")
    (folder / "report.html").write_text("as it was")
    (folder / "out.html").symlink_to("/etc/hostname")
    os.mkfifo(folder / "pipe")
    (campaign,) = repository.campaigns()

    def write(name: str) -> Any:
        return manifest.make_manifest(repository, campaign, [folder / name], folder)

    made = json.loads(write("given.txt"))
    assert [item["name"] for item in made["files"]] == ["given.txt"]
    (folder / "report.html").write_text("altered")
    assert list(manifest.differing(made, folder, None)) == ["file given.txt: is altered"]
    refused(InputError, write, "out.html", says="not in or below")
    for read in (write, lambda name: manifest.read_manifest(folder / name)):
        refused(InputError, read, "pipe", says="not a regular file")


def test_what_is_no_manifest_is_an_input_error(tmp_path: Path) -> None:
    for text in ("", "[", "[]", "{}", "[" * 5000, "9" * 5000, '{"a": 1, "a": 2}'):
        (tmp_path / "m.json").write_text(text)
        refused(InputError, manifest.read_manifest, tmp_path / "m.json", says=r"m\.json")


def test_manifest_with_other_types_is_an_input_error(
    document: dict[str, Any], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in (("files", {}), ("more", "told by nobody")):
        (folder / "m.json").write_text(json.dumps({**document, name: value}))
        refused(InputError, manifest.read_manifest, folder / "m.json", says="is not a manifest")
    monkeypatch.setattr("adeye.report.formats.manifest.MAX_BYTES", 10)
    refused(InputError, manifest.read_manifest, folder / "m.json", says="more than 10 bytes")
    refused(InputError, manifest.read_manifest, folder / "none.json", says="cannot be read")


pytest.importorskip("cryptography", reason="the extra `sign` is not installed")

CONTENT = b'{"a": 1}\n'


@pytest.fixture
def keys(tmp_path: Path) -> tuple[Path, Path]:
    private, public = tmp_path / "k.pem", tmp_path / "k.pub.pem"
    manifest.write_keys(private, public)
    (tmp_path / "m.sig").write_bytes(manifest.sign(CONTENT, private))
    return private, public


def test_content_is_encoded_as_the_envelope_says() -> None:
    assert manifest.encoded(b"hello") == b"DSSEv1 35 application/vnd.adeye.manifest+json 5 hello"


def test_signature_names_the_key_that_it_was_made_with(
    keys: tuple[Path, Path], tmp_path: Path
) -> None:
    signer = manifest.require_signed(CONTENT, tmp_path / "m.sig", keys[1])
    document = json.loads((tmp_path / "m.sig").read_text())
    assert document["signatures"][0]["keyid"] == signer
    assert manifest.write_keys(tmp_path / "other.pem", tmp_path / "other.pub.pem") != signer


def test_every_flipped_bit_of_the_content_is_noticed(
    keys: tuple[Path, Path], tmp_path: Path
) -> None:
    for place in range(8 * len(CONTENT)):
        damaged = bytearray(CONTENT)
        damaged[place // 8] ^= 1 << place % 8
        with pytest.raises(IntegrityError, match="is not what was signed"):
            manifest.require_signed(bytes(damaged), tmp_path / "m.sig", keys[1])


def test_key_and_signature_of_somebody_else_and_none_at_all_are_refused(
    keys: tuple[Path, Path], tmp_path: Path
) -> None:
    manifest.write_keys(tmp_path / "x.pem", tmp_path / "x.pub.pem")
    with pytest.raises(IntegrityError, match="another key signed it"):
        manifest.require_signed(CONTENT, tmp_path / "m.sig", tmp_path / "x.pub.pem")
    document = json.loads((tmp_path / "m.sig").read_text())
    (signed,) = document["signatures"]
    forged = {**signed, "sig": base64.b64encode(bytes(64)).decode()}
    for signatures in ([forged], []):
        (tmp_path / "m.sig").write_text(json.dumps({**document, "signatures": signatures}))
        refused(IntegrityError, manifest.require_signed, CONTENT, tmp_path / "m.sig", keys[1])


@pytest.mark.parametrize(
    "text", ["", "{}", "[]", '{"payloadType": "x", "signatures": []}', "[" * 90_000]
)
def test_what_is_no_signature_is_an_input_error(
    keys: tuple[Path, Path], tmp_path: Path, text: str
) -> None:
    (tmp_path / "m.sig").write_text(text)
    with pytest.raises(InputError, match=r"m\.sig"):
        manifest.require_signed(CONTENT, tmp_path / "m.sig", keys[1])


def test_what_is_no_key_is_an_input_error(keys: tuple[Path, Path], tmp_path: Path) -> None:
    private, public = keys
    (tmp_path / "text").write_text("secret words")
    (tmp_path / "large").write_bytes(b"x" * 200_000)
    for path in (tmp_path / "text", tmp_path / "large", tmp_path / "none", public):
        caught = refused(InputError, manifest.sign, CONTENT, path)
        assert "secret words" not in str(caught)
    refused(InputError, manifest.require_signed, CONTENT, tmp_path / "m.sig", private)


def test_keys_are_for_their_owner_and_not_overwritten(
    keys: tuple[Path, Path], tmp_path: Path
) -> None:
    assert keys[0].stat().st_mode & 0o077 == 0
    before = keys[0].read_bytes()
    refused(InputError, manifest.write_keys, *keys, says="is there already")
    assert keys[0].read_bytes() == before
    with pytest.raises(PlatformError, match="cannot be written"):
        manifest.write_keys(tmp_path / "no" / "k.pem", tmp_path / "p")
    with pytest.raises(PlatformError, match="cannot be written"):
        manifest.write_keys(tmp_path / "new.pem", tmp_path / "no" / "p")
    assert not (tmp_path / "new.pem").exists()
