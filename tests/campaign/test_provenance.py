"""Where a campaign comes from."""

from __future__ import annotations

import subprocess
from typing import TYPE_CHECKING

import adeye
from adeye.campaign import plan as subject
from adeye.campaign.plan import PACKAGES, git_state, provenance

if TYPE_CHECKING:
    from pathlib import Path

    import pytest


def git(folder: Path, *arguments: str) -> None:
    author = ["-c", "user.name=a", "-c", "user.email=a@b.c", "-c", "commit.gpgsign=false"]
    subprocess.run(["git", "-C", str(folder), *author, *arguments], check=True, capture_output=True)


def test_tool_packages_and_file_are_named(tmp_path: Path) -> None:
    found = provenance(tmp_path / "odd.yaml")
    assert found["adeye"] == adeye.__version__
    assert set(found["packages"]) == set(PACKAGES)
    assert all(found["packages"].values())
    assert found["odd_path"].endswith("odd.yaml")


def test_commit_of_the_odds_repository_and_whether_it_has_changes(tmp_path: Path) -> None:
    git(tmp_path, "init")
    path = tmp_path / "odd.yaml"
    path.write_text("odd: a\n", "utf-8")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-m", "first")
    clean = git_state(tmp_path)
    assert len(clean["commit"]) == 40
    assert clean["is_dirty"] is False
    path.write_text("odd: b\n", "utf-8")
    assert git_state(tmp_path) == {"commit": clean["commit"], "is_dirty": True}


def test_folder_outside_a_repository_has_no_commit(tmp_path: Path) -> None:
    assert git_state(tmp_path) == {}


def test_nothing_depends_on_git_or_a_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(*_: object, **__: object) -> None:
        raise OSError

    monkeypatch.setattr("adeye.campaign.plan.subprocess.run", missing)
    monkeypatch.setattr("adeye.campaign.plan.getpass.getuser", missing)
    monkeypatch.setattr(subject, "PACKAGES", ("not-installed-anywhere",))
    found = provenance(tmp_path / "odd.yaml")
    assert (found["git"], found["who"]) == ({}, "")
    assert found["packages"] == {"not-installed-anywhere": ""}


def test_program_that_a_repository_names_is_not_started(tmp_path: Path) -> None:
    git(tmp_path, "init")
    (tmp_path / "a").touch()
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-m", "first")
    canary = tmp_path / "canary"
    git(tmp_path, "config", "core.fsmonitor", f"touch {canary} #")
    assert git_state(tmp_path)["commit"]
    assert not canary.exists()
    git(tmp_path, "status")
    assert canary.exists()
