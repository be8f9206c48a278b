"""What a plan hashed is compared again: code, packages, files that channels read, metrics."""

from __future__ import annotations

import os
import shutil
import sys
from typing import TYPE_CHECKING, Any

import pytest

from adeye.campaign.parts import Unchanged
from adeye.errors import IntegrityError
from adeye.testing import zoo
from tests.project import MINI, Project

if TYPE_CHECKING:
    from pathlib import Path

    from tests.conftest import MakeProject

CHANNEL = """
from {package}gain import GAIN


class Steady:
    def __init__(self, parameters, context):
        pass

    def act(self, observation):
        return GAIN, 0.0
"""


@pytest.fixture
def project(make_project: MakeProject, monkeypatch: pytest.MonkeyPatch) -> Project:
    """Name a package, a program, and weights that a plug-in reads."""
    made = make_project({**MINI, "faults": [], "architectures": ["architectures/own.yaml"]})
    folder = made.folder / "odd" / "architectures"
    package = made.folder / "site" / "unchanging"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / "gain.py").write_text("GAIN = 0.0\n")
    (package / "steady.py").write_text(CHANNEL.format(package="unchanging."))
    monkeypatch.syspath_prepend(str(package.parent))
    # Another test has imported its own.
    for module in [module for module in sys.modules if module.partition(".")[0] == "unchanging"]:
        monkeypatch.delitem(sys.modules, module)
    (folder / "alone.py").write_text(CHANNEL.replace("from {package}gain import GAIN", "GAIN = 0"))
    (folder / "weights.bin").write_bytes(b"1")
    zoo.settle(folder)
    own: dict[str, Any] = made.read("odd/architectures/camera_radar.yaml")
    own["architecture"] = "own"
    plain = {"links": ["localisation"]}
    own["channels"] |= {
        "packed": {**plain, "kind": "unchanging.steady:Steady"},
        "alone": {**plain, "kind": "./alone.py:Steady", "files": ["weights.bin"]},
        "program": {**plain, "kind": "process", "parameters": zoo.parameters()},
    }
    made.write("odd/architectures/own.yaml", own)
    with made.edited_odd() as odd:
        odd["gate"] = {"architectures": ["own"]}
    return made


def files(project: Project) -> dict[str, Path]:
    folder = project.folder / "odd" / "architectures"
    package = project.folder / "site" / "unchanging"
    return {
        "unchanging.steady:Steady": package / "gain.py",
        "./alone.py:Steady": folder / "alone.py",
        "weights.bin": folder / "weights.bin",
        "./zoo.py": folder / "zoo.py",
    }


NAMES = ["unchanging.steady:Steady", "./alone.py:Steady", "weights.bin", "./zoo.py"]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("is_first", [True, False], ids=["since_the_plan", "since_a_block"])
def test_change_is_told_with_its_file_and_who_names_it(
    project: Project, name: str, *, is_first: bool
) -> None:
    unchanged = Unchanged(project.plan())
    if not is_first:
        unchanged.check()
    path = files(project)[name]
    path.write_bytes(path.read_bytes() + b"\n# changed")
    with pytest.raises(IntegrityError) as told:
        unchanged.check()
    assert str(told.value).startswith(f"{name}, which architecture own names, was changed")
    if not is_first or name != NAMES[0]:
        assert str(path) in str(told.value)


@pytest.mark.parametrize("name", NAMES)
def test_file_that_has_gone_is_told(project: Project, name: str) -> None:
    unchanged = Unchanged(project.plan())
    unchanged.check()
    files(project)[name].unlink()
    with pytest.raises(IntegrityError, match=name):
        unchanged.check()


def test_what_is_only_touched_is_hashed_once_and_passes(
    project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    hashed: list[str] = []
    unchanged = Unchanged(project.plan())
    original = type(next(iter(unchanged._seen))).is_as_planned

    def counting(source: Any) -> bool:
        hashed.append(source.name)
        return original(source)

    monkeypatch.setattr("adeye.campaign.parts.Source.is_as_planned", counting)
    for _ in range(3):
        unchanged.check()
    assert sorted(hashed) == sorted(NAMES)
    for path in files(project).values():
        os.utime(path, (0, 0))
    unchanged.check()
    unchanged.check()
    assert sorted(hashed) == sorted(2 * NAMES)


def test_copy_of_the_same_size_and_time_is_noticed(project: Project, tmp_path: Path) -> None:
    unchanged = Unchanged(project.plan())
    unchanged.check()
    path = files(project)["weights.bin"]
    other = tmp_path / "other.bin"
    other.write_bytes(b"2")
    shutil.copystat(path, other)
    other.replace(path)
    with pytest.raises(IntegrityError, match=r"weights\.bin"):
        unchanged.check()


def test_campaign_without_plugins_has_nothing_to_compare(make_project: MakeProject) -> None:
    assert not Unchanged(make_project().plan())._seen
