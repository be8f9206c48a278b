import os
import socket
import threading
from pathlib import Path
from typing import Any

import pytest

from adeye.errors import PlatformError, UsageError
from adeye.outputs import guarded, reads, replacing, replacing_folder, write_atomically
from tests.refusals import refused


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
    refused(PlatformError, write_atomically, b"new", path, says="No space left on device")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_folder_in_the_place_of_the_file_is_a_platform_error(tmp_path: Path) -> None:
    refused(PlatformError, write_atomically, b"x", tmp_path, says="cannot write")
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


def test_link_to_a_folder_stays_and_its_folder_is_replaced(tmp_path: Path) -> None:
    folder, link = tmp_path / "out", tmp_path / "latest"
    fill(folder, "one")
    link.symlink_to(folder)
    fill(link, "two")
    assert link.readlink() == folder
    assert [path.name for path in folder.iterdir()] == ["two"]
    assert sorted(tmp_path.iterdir()) == [link, folder]


def test_link_to_a_file_stays_and_leads_to_what_is_new(tmp_path: Path) -> None:
    path, link = tmp_path / "kept" / "a.json", tmp_path / "latest.json"
    path.parent.mkdir()
    path.write_text("{}")
    link.symlink_to(path)
    write_atomically(b'{"a": 1}', link)
    assert (link.readlink(), path.read_text()) == (path, '{"a": 1}')
    assert sorted(tmp_path.iterdir()) == [path.parent, link]


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
    refused(PlatformError, fill, folder, "two", says="No space left on device")
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


def test_device_gets_what_is_written_and_stays() -> None:
    write_atomically(b"x", Path("/dev/null"))
    refused(PlatformError, write_atomically, b"x", Path("/dev/full"), says="No space left")
    assert Path("/dev/null").is_char_device()
    assert Path("/dev/full").is_char_device()


@pytest.mark.parametrize("kind", ["file", "pipe", "device"])
def test_what_is_no_folder_is_not_replaced_by_one(tmp_path: Path, kind: str) -> None:
    path = tmp_path / kind
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/null")
    else:
        path.write_text("kept")
    before = path.stat()
    refused(UsageError, fill, path, "one", says="is no folder")
    assert path.stat() == before
    assert list(tmp_path.iterdir()) == [path]


def test_pipe_is_written_to(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    writer = threading.Thread(target=write_atomically, args=(b"x", path))
    writer.start()
    assert path.read_bytes() == b"x"
    writer.join()
    assert path.is_fifo()


def test_descriptor_is_written_to_from_where_it_is(tmp_path: Path) -> None:
    with (tmp_path / "file").open("wb", buffering=0) as stream:
        stream.write(b"before ")
        write_atomically(b"x", Path(f"/dev/fd/{stream.fileno()}"))
        write_atomically(b"y", Path(f"/proc/{os.getpid()}/fd/{stream.fileno()}"))
    assert (tmp_path / "file").read_bytes() == b"before xy"


def test_socket_is_not_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as server:
        server.bind("s")
        refused(UsageError, write_atomically, b"x", Path("s"), says="no regular file")
    assert Path("s").is_socket()


@pytest.mark.parametrize("name", ["any", "a.yaml", "a.py", "any-wal", "any.traces/x.npz"])
def test_what_must_not_be_lost_is_not_replaced(tmp_path: Path, name: str) -> None:
    (tmp_path / "any").write_bytes(b"SQLite format 3\0...")
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    if not path.exists():
        path.write_text("x", "utf-8")
    before = path.read_bytes()
    refused(UsageError, write_atomically, b"new", path, says="would be overwritten")
    assert path.read_bytes() == before


def test_home_that_no_shell_put_in_makes_no_folder_of_that_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("~/r.html", "~me/r.html"):
        refused(UsageError, write_atomically, b"x", Path(name), says="home that no shell put in")
    assert not list(tmp_path.iterdir())
    write_atomically(b"x", Path("~r.html"))


def test_evidence_and_what_was_never_written_are_not_replaced(tmp_path: Path) -> None:
    for name, content in (
        ("b.json", '{\n "schema": "adeye/baseline@1"}'),
        ("m.json", '{\n  "campaign": "c",\n  "schema": "adeye/manifest@1"}'),
        ("m.json.sig", '{"payloadType": "application/vnd.adeye.manifest+json"}'),
        ("key.txt", "-----BEGIN PRIVATE KEY-----"),
        ("pyproject.toml", "[project]"),
    ):
        path = tmp_path / name
        path.write_text(content, "utf-8")
        refused(UsageError, write_atomically, b"a,b\n", path, says="would be overwritten")
        assert path.read_text("utf-8") == content
        for kind, also_read, renewed in (("b", "-o", ""), ("m", "", "-o")):
            with guarded(
                {"-o": path} if kind == name[0] else {}, also_read=also_read, renewed=renewed
            ):
                if kind == name[0]:
                    write_atomically(b'{"new": 1}', path)
            path.write_text(content, "utf-8")
            if kind != name[0]:
                given: Any = {"also_read": also_read, "renewed": renewed}
                refused(UsageError, guarded({"-o": path}, **given).__enter__, says="overwritten")
        path.write_text("", "utf-8")
        write_atomically(b"a,b\n1,2\n", path)


def test_what_was_read_is_not_written_whoever_passes_over_the_refusal(tmp_path: Path) -> None:
    path, link = tmp_path / "table.json", tmp_path / "link.json"
    path.write_text("x", "utf-8")
    os.link(path, link)
    with guarded({"-o": link}):
        refused(UsageError, reads, path, says="is what is read")
        refused(UsageError, write_atomically, b"new", link, says="is what is read")
    write_atomically(b"new", link)
    assert path.read_text("utf-8") == "x"


@pytest.mark.parametrize("is_there", [False, True])
def test_no_output_is_in_the_folder_of_another(tmp_path: Path, *, is_there: bool) -> None:
    folder = tmp_path / "out"
    if is_there:
        (tmp_path / "link").symlink_to(folder)
        folder.mkdir()
    inner = (tmp_path / "link" if is_there else folder) / "a" / "r.mcap"
    for files in ({"--rosbag": folder, "--mcap": inner}, {"--mcap": inner, "--rosbag": folder}):
        refused(UsageError, guarded(files).__enter__, says="is in the folder of --rosbag")
    kept = folder / "any.db"
    refused(UsageError, guarded({"-o": folder}, taken=[kept]).__enter__, says="to the database")
    with guarded({"--rosbag": folder, "--mcap": tmp_path / "out.mcap", "-o": Path("/dev/stdout")}):
        pass


MAP = b'<?xml version="1.0"?>\n<!-- a - b --><OpenDRIVE><header vendor="adeye"/></OpenDRIVE>'
MCAP = b"\x89MCAP0\r\n\x01" + bytes([24, *[0] * 11, 12, 0, 0, 0])


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("x.bag", b"#ROSBAG V2.0\n... callerid=/talker", "a bag of ROS 1 that adeye has not"),
        ("x.bag", b"text", "a bag of ROS 1 that adeye has not written"),
        ("x.mcap", MCAP + b"rosbags-0.11", "a file of MCAP that adeye has not written"),
        ("x.json", MCAP + b"rosbags-0.11", "a file of MCAP that adeye has not written"),
        ("x.xml", MAP.replace(b"adeye", b"hand"), "a map that adeye has not written"),
        ("x.bin", b"PK\3\4" + bytes(26) + b"modelDescription.xml", "an FMU that adeye has not"),
    ],
)
def test_what_others_recorded_or_drew_is_not_replaced(
    tmp_path: Path, name: str, content: bytes, says: str
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    refused(UsageError, guarded({"-o": path}).__enter__, says=says)
    refused(UsageError, write_atomically, content, path, says=says)
    assert path.read_bytes() == content


KINDS: Any = [
    ("m.xodr", MAP),
    ("x.svg", b"<svg/>"),
    ("x.xml", b"<testsuites/>"),
    ("x.html", b"<!doctype html>\n<html lang='en'>"),
    ("x.mcap", MCAP + b"adeye 0.1.0"),
    ("x.bag", b"#ROSBAG V2.0\n... callerid=/adeye_replay"),
    ("x.fmu", b"PK\3\4" + bytes(26) + b"resources/adeye_part.json"),
    ("x.npz", b"PK\3\4" + bytes(26) + b"ego.npy"),
    ("x.parquet", b"PAR1"),
    ("x.json", b' {"schema": "adeye/report@1"}'),
    ("x.csv", b"a,b\n1,2\n"),
]


@pytest.mark.parametrize(("name", "content"), KINDS)
def test_only_content_of_one_kind_is_replaced(tmp_path: Path, name: str, content: bytes) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    write_atomically(content + b"\n", path)
    for other, new in KINDS:
        if other != name:
            refused(UsageError, write_atomically, new, path, says="would be overwritten")
    assert path.read_bytes() == content + b"\n"
    assert list(tmp_path.iterdir()) == [path]


def test_option_that_promises_a_kind_is_refused_before_anything_is_done(tmp_path: Path) -> None:
    path = tmp_path / "m.xodr"
    path.write_bytes(MAP)
    for option in ("--sarif", "--junit", "junit", "--mcap"):
        refused(UsageError, guarded({option: path}).__enter__, says="is a map, where")
    with guarded({"--xodr": path}):
        pass


def test_file_that_stays_as_it_was_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    old, new, absent = (tmp_path / name for name in ("old.xml", "new.html", "absent.json"))
    old.write_text("<testsuites/>", "ascii")
    new.write_text("<!DOCTYPE html><html></html>", "ascii")
    caplog.set_level("INFO", "adeye.notices")
    files = {"--junit": old, "--report": new, "--report-json": absent}

    def interrupted() -> None:
        with guarded(files):
            write_atomically(new.read_bytes(), new)
            raise KeyboardInterrupt

    refused(KeyboardInterrupt, interrupted)
    assert caplog.messages == [f"not written: what is in {old} is of before"]
    with guarded(files):
        for path in (old, new, absent):
            write_atomically(b"{}" if path == absent else path.read_bytes(), path)
    assert len(caplog.messages) == 1


def test_refused_file_is_told_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = tmp_path / "report.html"
    path.write_text("<!DOCTYPE html><html></html>", "ascii")
    caplog.set_level("INFO", "adeye.notices")
    with pytest.raises(UsageError), guarded({"--report": path}):
        reads(path)
    assert caplog.messages == []
