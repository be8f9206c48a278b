"""Keys and signatures; each change to what was signed is noticed."""

from __future__ import annotations

import base64
import json
import sys
from typing import TYPE_CHECKING

import pytest

from adeye.errors import InputError, IntegrityError, PlatformError
from adeye.report.formats.manifest import encoded, require_signed, sign, write_keys

if TYPE_CHECKING:
    from pathlib import Path

pytest.importorskip("cryptography", reason="the extra `sign` is not installed")

CONTENT = b'{"a": 1}\n'


@pytest.fixture
def keys(tmp_path: Path) -> tuple[Path, Path]:
    private, public = tmp_path / "k.pem", tmp_path / "k.pub.pem"
    write_keys(private, public)
    (tmp_path / "m.sig").write_bytes(sign(CONTENT, private))
    return private, public


def test_content_is_encoded_as_the_envelope_says() -> None:
    assert encoded(b"hello") == b"DSSEv1 35 application/vnd.adeye.manifest+json 5 hello"


def test_signature_names_the_key_that_it_was_made_with(
    keys: tuple[Path, Path], tmp_path: Path
) -> None:
    signer = require_signed(CONTENT, tmp_path / "m.sig", keys[1])
    document = json.loads((tmp_path / "m.sig").read_text())
    assert document["signatures"][0]["keyid"] == signer
    assert write_keys(tmp_path / "other.pem", tmp_path / "other.pub.pem") != signer


def test_every_flipped_bit_of_the_content_is_noticed(
    keys: tuple[Path, Path], tmp_path: Path
) -> None:
    for place in range(8 * len(CONTENT)):
        damaged = bytearray(CONTENT)
        damaged[place // 8] ^= 1 << place % 8
        with pytest.raises(IntegrityError, match="is not what was signed"):
            require_signed(bytes(damaged), tmp_path / "m.sig", keys[1])


def test_key_and_signature_of_somebody_else_are_refused(
    keys: tuple[Path, Path], tmp_path: Path
) -> None:
    write_keys(tmp_path / "x.pem", tmp_path / "x.pub.pem")
    with pytest.raises(IntegrityError, match="another key signed it"):
        require_signed(CONTENT, tmp_path / "m.sig", tmp_path / "x.pub.pem")
    document = json.loads((tmp_path / "m.sig").read_text())
    document["signatures"][0]["sig"] = base64.b64encode(bytes(64)).decode()
    (tmp_path / "m.sig").write_text(json.dumps(document))
    with pytest.raises(IntegrityError):
        require_signed(CONTENT, tmp_path / "m.sig", keys[1])


@pytest.mark.parametrize(
    "text", ["", "{}", "[]", '{"payloadType": "x", "signatures": []}', "[" * 90_000]
)
def test_what_is_no_signature_is_an_input_error(
    keys: tuple[Path, Path], tmp_path: Path, text: str
) -> None:
    (tmp_path / "m.sig").write_text(text)
    with pytest.raises(InputError, match=r"m\.sig"):
        require_signed(CONTENT, tmp_path / "m.sig", keys[1])


def test_empty_list_of_signatures_signs_nothing(keys: tuple[Path, Path], tmp_path: Path) -> None:
    document = json.loads((tmp_path / "m.sig").read_text())
    (tmp_path / "m.sig").write_text(json.dumps({**document, "signatures": []}))
    with pytest.raises(IntegrityError):
        require_signed(CONTENT, tmp_path / "m.sig", keys[1])


def test_what_is_no_key_is_an_input_error(keys: tuple[Path, Path], tmp_path: Path) -> None:
    private, public = keys
    (tmp_path / "text").write_text("secret words")
    (tmp_path / "large").write_bytes(b"x" * 200_000)
    for path in (tmp_path / "text", tmp_path / "large", tmp_path / "none", public):
        with pytest.raises(InputError) as caught:
            sign(CONTENT, path)
        assert "secret words" not in str(caught.value)
    with pytest.raises(InputError):
        require_signed(CONTENT, tmp_path / "m.sig", private)


def test_keys_are_for_their_owner_and_not_overwritten(
    keys: tuple[Path, Path], tmp_path: Path
) -> None:
    assert keys[0].stat().st_mode & 0o077 == 0
    before = keys[0].read_bytes()
    with pytest.raises(InputError, match="is there already"):
        write_keys(*keys)
    assert keys[0].read_bytes() == before
    with pytest.raises(PlatformError, match="cannot be written"):
        write_keys(tmp_path / "no" / "k.pem", tmp_path / "p")


def test_without_the_extra_it_says_what_to_install(
    keys: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "cryptography.exceptions", None)
    with pytest.raises(PlatformError, match=r"adeye\[sign\]"):
        sign(CONTENT, keys[0])
