import hashlib
from pathlib import Path

from adeye.store.kept_files import SUFFIX, content_name, folder_of


def test_file_is_named_after_its_content(tmp_path: Path) -> None:
    path = tmp_path / f"a{SUFFIX}"
    path.write_bytes(b"traces")
    assert content_name(path) == hashlib.sha256(b"traces").hexdigest()
    path.write_bytes(b"traceS")
    assert content_name(path) != hashlib.sha256(b"traces").hexdigest()


def test_folder_is_beside_the_database() -> None:
    assert folder_of(Path("x/y.db")) == Path("x/y.traces")
