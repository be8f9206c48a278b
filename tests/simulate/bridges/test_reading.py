"""Programs read what identifies results, and installed software; the system denies the rest."""

import os
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from adeye.signals import OK, SILENT, Observation
from adeye.simulate.bridges import programs
from adeye.simulate.bridges.master import simulate
from adeye.simulate.bridges.programs import Broken, Ceilings, Children
from adeye.simulate.bridges.warden import has_landlock
from adeye.simulate.channels.process.channel import ProcessChannel, counted_files
from adeye.spec.channels import ProcessParameters
from adeye.testing import channel_context

pytestmark = pytest.mark.skipif(not has_landlock(), reason="this system has no Landlock")

CEILINGS = Ceilings(cpu_s=20, memory=2**31, file_size=2**20, open_files=64, processes=8)
DENIED = "Permission denied"
PROGRAM = """
import json, sys
import beside
hello = json.loads(sys.stdin.readline())
with open({reads!r}) as stream:
    stream.read()
print(json.dumps({{"hello": hello["hello"]}}), flush=True)
for line in sys.stdin:
    tick = json.loads(line)["tick"]
    print(json.dumps({{"tick": tick, "acceleration": 0.0, "steering_angle": 0.0}}), flush=True)
"""


def answer(body: str, reads: Sequence[Path] = ()) -> bytes:
    """Return what a program answers, whose body is Python."""
    children = Children()
    text = f"import os, subprocess, sys\nsys.stdin.readline()\n{body}"
    argv = [os.path.realpath(sys.executable), "-I", "-S", "-c", text]
    children.start(0, argv, CEILINGS, reads=reads)
    try:
        said = children.ask({0: b"\n"}, {0: 20.0})[0]
        assert not isinstance(said, Broken)
        return said
    finally:
        children.close()


def reading(path: str | Path) -> str:
    return f"""
try: print(open({str(path)!r}).read().strip(), flush=True)
except OSError as error: print(error.strerror, flush=True)
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "gains.csv"
    path.write_text("0.5\n")
    return path


def test_program_reads_what_it_was_started_with(file: Path) -> None:
    assert answer(reading(file), [file]) == b"0.5"


def test_another_file_of_the_folder_is_denied(file: Path) -> None:
    other = file.with_name("other.csv")
    other.write_text("1.5\n")
    assert answer(reading(other), [file]) == DENIED.encode()


def test_neither_links_nor_the_list_of_processes_lead_around_it(file: Path) -> None:
    link = f"os.symlink({str(file)!r}, 'link')\n{reading('link')}"
    assert answer(link) == DENIED.encode()
    assert answer(reading(f"/proc/{os.getpid()}/root{file}")) == DENIED.encode()
    assert answer(f"os.chdir('/')\n{reading(os.path.relpath(file, '/'))}") == DENIED.encode()


def test_what_a_program_starts_reads_no_more_than_it(file: Path) -> None:
    cat = f"print(subprocess.run(['/bin/cat', {str(file)!r}], capture_output=True), flush=True)"
    assert b"returncode=0, stdout=b'0.5" in answer(cat, [file])
    assert DENIED.encode() in answer(cat)


def test_another_program_of_the_folder_is_not_executed(tmp_path: Path) -> None:
    path = Path(shutil.copy("/bin/true", tmp_path / "helper"))
    started = f"""
try: print(subprocess.run([{str(path)!r}]).returncode, flush=True)
except OSError as error: print(error.strerror, flush=True)
"""
    assert answer(started) == DENIED.encode()
    assert answer(started, [path]) == b"0"


def test_what_it_writes_in_its_working_folder_is_its_own() -> None:
    assert answer(f"open('note', 'w').write('mine')\n{reading('note')}") == b"mine"


def test_software_around_a_folder_of_the_path_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "tool" / "bin").mkdir(parents=True)
    (tmp_path / "tool" / "lib").mkdir()
    (tmp_path / "tool" / "lib" / "data").write_text("installed\n")
    (tmp_path / "plain").write_text("mine\n")
    monkeypatch.setenv("PATH", f"{tmp_path}/tool/bin:{os.environ['PATH']}")
    assert answer(reading(tmp_path / "tool" / "lib" / "data")) == b"installed"
    assert answer(reading(tmp_path / "plain")) == DENIED.encode()


def test_beside_the_users_own_programs_is_no_software_but_theirs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    local = tmp_path / "home" / ".local"
    for name in ("lib/tool/data", "share/uv/data", "share/models/data"):
        (local / name).parent.mkdir(parents=True)
        (local / name).write_text("there\n")
    (local / "bin").mkdir()
    monkeypatch.setattr(programs, "_homes", lambda: (tmp_path / "home" / "x",))
    monkeypatch.setenv("PATH", f"{local}/bin:{os.environ['PATH']}")
    assert answer(reading(local / "lib/tool/data")) == b"there"
    assert answer(reading(local / "share/uv/data")) == b"there"
    assert answer(reading(local / "share/models/data")) == DENIED.encode()


def test_folder_of_the_path_that_holds_a_counted_file_is_no_software(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (file.parent / "bin").mkdir()
    other = file.with_name("other.csv")
    other.write_text("1.5\n")
    link = file.parent.with_name("link")
    link.symlink_to(file.parent)
    for at in (file.parent, link, file.parent / "bin" / ".." / "bin" / ".."):
        monkeypatch.setenv("PATH", f"{at}/bin:{at}:{os.environ['PATH']}")
        assert answer(reading(other), [file]) == DENIED.encode()


def test_project_below_the_system_leaves_its_software() -> None:
    """As in containers; nothing is executed, for nobody but root may write there."""
    found = programs._readable("/usr/bin/python3", [Path("/usr/src/app/odd/drive.py")])
    assert {"/usr/bin", "/usr/lib", "/usr/share"} <= {*found}
    assert not {"/usr", "/usr/src", "/usr/src/app"} & {*found}


def test_home_is_no_software_around_its_bin(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "bin").mkdir()
    (tmp_path / "mine").write_text("mine\n")
    monkeypatch.setattr(programs, "_homes", lambda: (tmp_path / "x",))
    monkeypatch.setenv("PATH", f"{tmp_path}/bin:{os.environ['PATH']}")
    assert answer(reading(tmp_path / "mine")) == DENIED.encode()


def drive(folder: Path, files: Sequence[str]) -> tuple[int, str]:
    """Return the status of a channel's first answer, and how it failed."""
    channel = ProcessChannel(folder, [files])
    given = ProcessParameters(command=("python3", "./drive.py"))
    channel.reset(channel_context([given], links=(), sensors={}, runs=1))
    command = channel.act(Observation(0.0, {}, {}, None, np.array([True])))
    channel.close()
    event = channel.events[0]
    return int(command.status[0]), "" if event is None else event.detail


def test_channel_reads_its_files_its_program_and_what_that_imports(tmp_path: Path) -> None:
    (tmp_path / "drive.py").write_text(PROGRAM.format(reads=str(tmp_path / "net.bin")))
    (tmp_path / "beside.py").write_text("")
    (tmp_path / "net.bin").write_text("")
    found = counted_files(("python3", "./drive.py"), ("net.bin",), tmp_path)
    assert [path.name for path in found] == ["drive.py", "net.bin", "beside.py"]
    assert drive(tmp_path, ["net.bin"]) == (OK, "")


def test_file_that_the_channel_does_not_name_ends_its_program(tmp_path: Path) -> None:
    (tmp_path / "drive.py").write_text(PROGRAM.format(reads=str(tmp_path / "net.bin")))
    (tmp_path / "beside.py").write_text("")
    (tmp_path / "net.bin").write_text("")
    status, detail = drive(tmp_path, [])
    assert status == SILENT
    assert "PermissionError: [Errno 13] Permission denied: 'net.bin'" in detail
    assert "counted" in detail


def test_fmu_opens_no_file_but_its_own(tmp_path: Path) -> None:
    fmus = pytest.importorskip("tests.simulate.bridges.fmus")
    file = tmp_path / "gains.csv"
    file.write_text("0.5\n")
    opens = f'fopen("{file}", "r") ? fmi2Error : OK'
    built = fmus.build_fmu(tmp_path, "nosy", [fmus.Var("y", "output")], "", status=opens)
    _, rows = simulate(built, 0.2, 0.1, None, {})
    assert len(list(rows)) == 3
