"""Plug-ins and monitors of an architecture, checked at plan time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from adeye.campaign.parts import Parts, load_parts
from adeye.errors import SpecError
from adeye.spec.load import load_architecture
from tests.project import CANDIDATE, Project

if TYPE_CHECKING:
    from tests.conftest import MakeProject

CHANNEL = """
from adeye import ports


class Own:
    class Parameters(ports.Parameters):
        gain: float = 1.0

    monitor_ids = ({monitors})

    def __init__(self, parameters, context):
        self.gain = parameters.gain

    def act(self, observation):
        return None


class NoChannel:
    pass
"""


@pytest.fixture
def project(make_project: MakeProject) -> Project:
    made = make_project()
    write(made)
    return made


def write(project: Project, monitors: str = "") -> None:
    path = project.folder / "odd" / "architectures" / "own.py"
    path.write_text(CHANNEL.replace("{monitors}", monitors), "utf-8")


def parts(project: Project, **channel: Any) -> Parts:
    """Load the candidate with a plug-in beside its channels."""
    if channel:
        with project.edited(CANDIDATE) as candidate:
            candidate["channels"]["own"] = {"kind": "./own.py:Own", "rate": "20 Hz", **channel}
    return load_parts(load_architecture(project.folder / CANDIDATE))


def test_architecture_of_built_in_parts_has_no_plugins(project: Project) -> None:
    found = parts(project)
    assert (found.plugins, found.digest) == ((), "")
    assert "object_danger" in found.monitors


def test_plugin_is_known_by_its_code(project: Project) -> None:
    before = parts(project, links=["front_camera"])
    assert [part.name for part in before.plugins] == ["./own.py:Own"]
    path = project.folder / "odd" / "architectures" / "own.py"
    path.write_text(path.read_text("utf-8") + "\n# a comment is a line, too\n", "utf-8")
    after = parts(project)
    assert len({before.digest, after.digest, ""}) == 3


def test_wrong_parameter_is_refused_where_it_is_written(project: Project) -> None:
    with pytest.raises(SpecError, match=r"channels\.own\.parameters\.gian") as caught:
        parts(project, parameters={"gian": 2.0})
    where = caught.value.where
    assert where is not None
    line = (project.folder / CANDIDATE).read_text("utf-8").splitlines()[where.line - 1]
    assert "gian" in line


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("./own.py:NoChannel", r"has no act\(\)"),
        ("./own.py:Owm", "Owm"),
        ("./there.py:Own", "no file"),
        ("not_installed_anywhere:Own", "no module"),
    ],
)
def test_what_is_no_channel_is_refused_where_it_is_named(
    project: Project, kind: str, message: str
) -> None:
    with pytest.raises(SpecError, match=message) as caught:
        parts(project, kind=kind)
    assert str(caught.value.where).partition(":")[0].endswith("camera_radar.yaml")


def test_monitor_of_two_channels_is_refused(project: Project) -> None:
    write(project, monitors='"object_danger",')
    # A class of one object per run has no monitors; on the batch it declares them.
    path = project.folder / "odd" / "architectures" / "own.py"
    batch = "    def reset(self, context):\n        pass\n\n    def act"
    text = path.read_text("utf-8").replace("(self, parameters, context)", "(self)")
    text = text.replace("self.gain = parameters.gain", "self.gain = 1.0")
    path.write_text(text.replace("    def act", batch), "utf-8")
    with pytest.raises(SpecError, match="'object_danger' is declared by another channel"):
        parts(project, links=["front_camera"])


def test_plugin_sensor_needs_sense(project: Project) -> None:
    with project.edited(CANDIDATE) as candidate:
        candidate["sensors"]["extra"] = {"kind": "./own.py:Own", "rate": "20 Hz"}
    with pytest.raises(SpecError, match=r"has no sense\(\)"):
        parts(project)


def policy_parts(project: Project, source: str, name: str = "drive") -> Parts:
    path = project.folder / "odd" / "architectures" / "policy.py"
    path.write_text(source, "utf-8")
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["nominal"] = {
            "kind": "policy",
            "parameters": {"policy": f"./policy.py:{name}"},
        }
    return load_parts(load_architecture(project.folder / CANDIDATE))


def test_code_of_a_policy_is_part_of_the_identity(project: Project) -> None:
    source = "def drive(observation):\n    return 0.0, 0.0\n"
    found = policy_parts(project, source)
    assert [part.name for part in found.plugins] == ["./policy.py:drive"]
    assert found.digest == policy_parts(project, source).digest
    assert found.digest != policy_parts(project, source + "# changed\n").digest


def test_policy_that_is_none_is_refused_where_it_is_named(project: Project) -> None:
    with pytest.raises(SpecError, match=r"camera_radar\.yaml:\d+:\d+.*is no policy"):
        policy_parts(project, "drive = 3\n")


def listed(project: Project, *files: str) -> Parts:
    """Let the plug-in beside the candidate's channels read files."""
    return parts(project, links=["front_camera"], files=list(files))


def test_content_of_a_file_that_a_channel_reads_is_part_of_the_identity(project: Project) -> None:
    without = parts(project, links=["front_camera"])
    weights = project.folder / "odd" / "architectures" / "weights.bin"
    weights.write_bytes(b"first")
    first = listed(project, "weights.bin")
    weights.write_bytes(b"again")
    again = listed(project, "weights.bin")
    weights.write_bytes(b"first")
    assert [file.owner for file in first.files] == ["channels.own"]
    assert len({without.digest, first.digest, again.digest}) == 3
    assert listed(project, "weights.bin").digest == first.digest


def test_policy_may_read_files_too(project: Project) -> None:
    source = "def drive(observation):\n    return 0.0, 0.0\n"
    before = policy_parts(project, source)
    (project.folder / "odd" / "architectures" / "net.bin").write_bytes(b"1")
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["nominal"]["files"] = ["net.bin"]
    after = load_parts(load_architecture(project.folder / CANDIDATE))
    assert [file.name for file in after.files] == ["net.bin"]
    assert after.digest != before.digest


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (("weights.bin", "weihgts.bin"), "channel own: 'weihgts.bin' is not there"),
        (("weights.bin", "."), r"channel own: '\.' is no file"),
        (("weights.bin", "../tested.yaml"), r"'\.\./tested\.yaml' is outside of"),
        (("weights.bin", "./weights.bin"), r"file '\./weights\.bin' is listed twice"),
    ],
)
def test_file_that_cannot_be_read_is_refused_where_it_is_listed(
    project: Project, names: tuple[str, ...], message: str
) -> None:
    (project.folder / "odd" / "architectures" / "weights.bin").write_bytes(b"1")
    with pytest.raises(SpecError, match=message) as caught:
        listed(project, *names)
    where = caught.value.where
    assert where is not None
    line = (project.folder / CANDIDATE).read_text("utf-8").splitlines()[where.line - 1]
    assert line.strip().removeprefix("- ").strip("'\"") == names[1]


def process_parts(project: Project, *command: str, files: tuple[str, ...] = ()) -> Parts:
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["nominal"] = {
            "kind": "process",
            "files": list(files),
            "parameters": {"command": list(command)},
        }
    return load_parts(load_architecture(project.folder / CANDIDATE))


def test_files_of_a_command_are_part_of_the_identity(project: Project) -> None:
    folder = project.folder / "odd" / "architectures"
    (folder / "drive").write_text("#!/bin/sh\n")
    (folder / "drive").chmod(0o755)
    (folder / "net.bin").write_bytes(b"1")
    found = process_parts(project, "./drive", "--fast", files=("net.bin",))
    assert [(item.owner, item.name) for item in found.files] == [
        ("channels.nominal", "./drive"),
        ("channels.nominal", "net.bin"),
    ]
    seen = {found.digest}
    (folder / "drive").write_text("#!/bin/sh\nexit\n")
    seen.add(load_parts(load_architecture(project.folder / CANDIDATE)).digest)
    (folder / "net.bin").write_bytes(b"2")
    seen.add(load_parts(load_architecture(project.folder / CANDIDATE)).digest)
    assert len(seen - {""}) == 3


@pytest.mark.parametrize(
    ("command", "files", "message", "line"),
    [
        (("./gone",), (), "'./gone' is not there", "- ./gone"),
        (("sh", "-c", "exit"), (), "names no file of the project", "- sh"),
        (("sh", "./own.py"), ("own.py",), "'own.py' is listed twice", "- own.py"),
    ],
)
def test_wrong_program_is_refused_where_it_is_written(
    project: Project, command: tuple[str, ...], files: tuple[str, ...], message: str, line: str
) -> None:
    with pytest.raises(SpecError, match=message) as caught:
        process_parts(project, *command, files=files)
    where = caught.value.where
    assert where is not None
    lines = (project.folder / CANDIDATE).read_text("utf-8").splitlines()
    assert lines[where.line - 1].strip() == line
