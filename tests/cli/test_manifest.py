"""``manifest write|verify|keygen`` on a small campaign."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from adeye.store.repository import Repository
from tests.store.conftest import Example
from tests.store.rows import complete_block

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def campaign(folder: Path) -> str:
    example = Example()
    with Repository.open(folder / "x.db") as repository:
        plan = repository.plan_campaign(example.record(), example.cases(4))
        while (block := repository.claim_block(campaign=plan.campaign)) is not None:
            complete_block(repository, block, example.runs(block), example.judged(block))
        return plan.campaign


@pytest.mark.slow
def test_unsigned_manifest_tells_of_an_altered_file(
    adeye: Any, folder: Path, campaign: str
) -> None:
    (folder / "report.html").write_text("green")
    written = adeye("manifest", "write", "--db", "x.db", "--file", "report.html", "--json")
    assert written.code == 0
    assert (written.document["campaign"], written.document["signature"]) == (campaign, None)
    verify = ("manifest", "verify", "manifest.json", "--unsigned", "--db", "x.db")
    assert adeye(*verify).out == "manifest.json: everything is as it says, unsigned.\n"
    (folder / "report.html").write_text("red")
    ended = adeye(*verify, "--json")
    assert (ended.code, ended.document["findings"]) == (4, ["file report.html: is altered"])
    assert adeye(*verify).out == "file report.html: is altered\n"
    assert adeye("manifest", "verify", "manifest.json", "--unsigned", "--files-only").code == 4


def test_verification_needs_a_key_or_a_word(adeye: Any, campaign: str) -> None:
    assert campaign
    ended = adeye("manifest", "verify", "manifest.json", "--db", "x.db")
    assert ended.code == 2
    assert "needs either --key or --unsigned" in ended.err


def test_key_is_not_overwritten_by_the_signature(adeye: Any, folder: Path, campaign: str) -> None:
    pytest.importorskip("cryptography", reason="the extra `sign` is not installed")
    assert campaign
    for key, words in (("manifest.json.sig", "is a key"), ("k.pem", "")):
        assert adeye("manifest", "keygen", "--private", key, "--public", f"{key}.pub").code == 0
        before = (folder / key).read_bytes()
        for _ in range(2):
            ended = adeye("manifest", "write", "--db", "x.db", "--sign", key)
            assert (ended.code, words in ended.err) == (2 if words else 0, True)
        assert (folder / key).read_bytes() == before
        (folder / "manifest.json.sig").unlink()
    ended = adeye("query", "campaigns", "--db", "x.db", "-o", "manifest.json")
    assert (ended.code, "is a baseline, a manifest" in ended.err) == (2, True)


@pytest.mark.slow
def test_signed_manifest_is_checked_with_the_public_key(
    adeye: Any, folder: Path, campaign: str
) -> None:
    pytest.importorskip("cryptography", reason="the extra `sign` is not installed")
    assert campaign
    assert adeye("manifest", "keygen", "--private", "k.pem", "--public", "k.pub.pem").code == 0
    written = adeye("manifest", "write", "--db", "x.db", "--sign", "k.pem")
    assert "manifest.json.sig: signed" in written.out
    verify = ("manifest", "verify", "manifest.json", "--key", "k.pub.pem", "--db", "x.db")
    assert "signed with key" in adeye(*verify).out
    text = (folder / "manifest.json").read_text()
    (folder / "manifest.json").write_text(text.replace('"leaves": 4', '"leaves": 5'))
    ended = adeye(*verify)
    assert (ended.code, "is not what was signed" in ended.err) == (4, True)
