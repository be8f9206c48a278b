"""Detached signatures: Ed25519 over an envelope in the manner of DSSE.

Source:
    Dead Simple Signing Envelope 1.0.2, protocol: what is signed is the type and the content with
    their lengths before them ("pre-authentication encoding"). RFC 8032 for Ed25519.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
import os
from typing import TYPE_CHECKING, Any, Final

from adeye.errors import InputError, IntegrityError, PlatformError
from adeye.outputs import reads

if TYPE_CHECKING:
    from pathlib import Path

PAYLOAD_TYPE: Final = "application/vnd.adeye.manifest+json"
_MAX_BYTES: Final = 100_000
_KEYS_HELP: Final = (
    "Make a pair with 'adeye manifest keygen' or 'openssl genpkey -algorithm ed25519'."
)


def encoded(content: bytes) -> bytes:
    """Give what is signed of a content.

    >>> encoded(b"{}")
    b'DSSEv1 35 application/vnd.adeye.manifest+json 2 {}'
    """
    kind = PAYLOAD_TYPE.encode()
    return b" ".join([b"DSSEv1", b"%d" % len(kind), kind, b"%d" % len(content), content])


def sign(content: bytes, key: Path) -> bytes:
    """Sign a content.

    Args:
        content: What is signed; it is not in the signature.
        key: PEM file of a private Ed25519 key without a password.

    Returns:
        The signature as JSON.

    Raises:
        InputError: The file is not such a key.
        PlatformError: The extra is not installed.
    """
    library = _library()
    private = _loaded(key, lambda text: library.load_pem_private_key(text, password=None))
    if not isinstance(private, library.Ed25519PrivateKey):
        raise InputError(f"{key}: is no private Ed25519 key", remedy=_KEYS_HELP)
    envelope = {
        "payloadType": PAYLOAD_TYPE,
        "payloadSha256": hashlib.sha256(content).hexdigest(),
        "signatures": [
            {
                "keyid": _key_id(private.public_key()),
                "sig": base64.b64encode(private.sign(encoded(content))).decode(),
            }
        ],
    }
    return f"{json.dumps(envelope, indent=2, sort_keys=True)}\n".encode()


def require_signed(content: bytes, signature: Path, key: Path) -> str:
    """Check a signature.

    Args:
        content: What should have been signed.
        signature: File of the signature.
        key: PEM file of the public Ed25519 key.

    Returns:
        Id of the key: sha256 of its 32 bytes in hex.

    Raises:
        InputError: A file is missing or is not what it should be.
        IntegrityError: The content is not what was signed, or another key signed it.
        PlatformError: The extra is not installed.
    """
    library = _library()
    public = _loaded(key, library.load_pem_public_key)
    if not isinstance(public, library.Ed25519PublicKey):
        raise InputError(f"{key}: is no public Ed25519 key", remedy=_KEYS_HELP)
    key_id = _key_id(public)
    for signed in _signatures(signature):
        try:
            public.verify(signed, encoded(content))
        except library.InvalidSignature:
            continue
        return key_id
    raise IntegrityError(
        f"{signature}: the manifest is not what was signed with key {key_id[:16]}, or another "
        "key signed it. Do not rely on it; ask its author for the original."
    )


def _signatures(path: Path) -> list[bytes]:
    try:
        document = json.loads(_read(path))
        if document["payloadType"] != PAYLOAD_TYPE:
            raise InputError(
                f"{path}: signs {document['payloadType']!r}, not {PAYLOAD_TYPE}",
                remedy="Name the signature of a manifest.",
            )
        return [base64.b64decode(item["sig"], validate=True) for item in document["signatures"]]
    except (ValueError, KeyError, TypeError, binascii.Error, RecursionError) as error:
        raise InputError(
            f"{path}: is no signature of a manifest", remedy="Name the .sig file beside it."
        ) from error


def write_keys(private: Path, public: Path) -> str:
    """Make a pair of keys; the private one is readable by its owner only.

    Returns:
        Id of the key.

    Raises:
        InputError: A file is there already.
        PlatformError: They cannot be written, or the extra is not installed.
    """
    library = _library()
    made = library.Ed25519PrivateKey.generate()
    secret = made.private_bytes(
        library.Encoding.PEM, library.PrivateFormat.PKCS8, library.NoEncryption()
    )
    open_part = made.public_key().public_bytes(
        library.Encoding.PEM, library.PublicFormat.SubjectPublicKeyInfo
    )
    for path, content, mode in ((private, secret, 0o600), (public, open_part, 0o644)):
        try:
            descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
        except FileExistsError as error:
            raise InputError(
                f"{path} is there already", remedy="Name another file; keys are not overwritten."
            ) from error
        except OSError as error:
            raise PlatformError(
                f"{path} cannot be written: {error.strerror}. Choose another place."
            ) from error
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(content)
    return _key_id(made.public_key())


def _key_id(public: Any) -> str:
    return hashlib.sha256(public.public_bytes_raw()).hexdigest()


def _loaded(path: Path, load: Any) -> Any:
    try:
        return load(_read(path))
    except (ValueError, TypeError, _library().UnsupportedAlgorithm) as error:
        # The message of the library may quote the key.
        raise InputError(
            f"{path}: is no key in PEM, or has a password", remedy=_KEYS_HELP
        ) from error


def _read(path: Path) -> bytes:
    reads(path)
    try:
        with path.open("rb") as stream:
            content = stream.read(_MAX_BYTES + 1)
    except OSError as error:
        raise InputError(
            f"{path} cannot be read: {error.strerror}", remedy="Name another file."
        ) from error
    if len(content) > _MAX_BYTES:
        raise InputError(f"{path}: more than {_MAX_BYTES:,} bytes", remedy="Name another file.")
    return content


class _Library:
    """What is used of ``cryptography``."""

    def __init__(self) -> None:
        from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
        from cryptography.hazmat.primitives import serialization
        from cryptography.hazmat.primitives.asymmetric import ed25519

        self.InvalidSignature, self.UnsupportedAlgorithm = InvalidSignature, UnsupportedAlgorithm
        self.Ed25519PrivateKey = ed25519.Ed25519PrivateKey
        self.Ed25519PublicKey = ed25519.Ed25519PublicKey
        self.load_pem_private_key = serialization.load_pem_private_key
        self.load_pem_public_key = serialization.load_pem_public_key
        self.Encoding, self.NoEncryption = serialization.Encoding, serialization.NoEncryption
        self.PrivateFormat = serialization.PrivateFormat
        self.PublicFormat = serialization.PublicFormat


def _library() -> Any:
    try:
        return _Library()
    except ImportError as error:
        raise PlatformError("signatures need adeye[sign]: pip install 'adeye[sign]'") from error
