"""Plug-ins are listed with the hash that loading them gives, and none is imported."""

import sys
from pathlib import Path

import pytest

from adeye.campaign.parts import named, offered
from adeye.plugins import load_part
from adeye.spec.load import load_odd
from tests.test_malformed_inputs import FILES, IN_ODD, IN_ONE, NOMINAL

BOMB = "import pathlib\npathlib.Path({canary!r}).touch()\n\nclass Planner:\n    pass\n"


@pytest.fixture
def canary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Install a package that says so when it is imported."""
    canary = tmp_path / "canary"
    package = tmp_path / "site" / "bombs"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(BOMB.format(canary=str(canary)), encoding="utf-8")
    info = tmp_path / "site" / "bombs-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: bombs\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text(
        "[adeye.channels]\nbomb = bombs:Planner\n[other]\nx = bombs:X\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    return canary


@pytest.fixture
def odd(tmp_path: Path) -> Path:
    texts = {**FILES, IN_ONE: FILES[IN_ONE].replace(NOMINAL, NOMINAL.replace(
        "kind: nominal", "kind: bombs:Planner"))}  # fmt: skip
    texts[IN_ODD] += "plugins: [./metric.py:Odd, ./missing.py:Odd]\n"
    texts["odd/metric.py"] = "raise SystemExit\n"
    for name, text in texts.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return tmp_path / IN_ODD


def test_packages_offer_without_being_imported(canary: Path) -> None:
    (found,) = [item for item in offered() if item.package == "bombs"]
    assert (found.kind, found.name, found.version) == ("channels", "bomb", "1.2")
    assert found.source == "bombs:Planner"
    assert not canary.exists()
    assert "bombs" not in sys.modules


def test_named_plugins_have_the_hash_that_loading_gives(canary: Path, odd: Path) -> None:
    found = {(item.kind, item.source): item.digest for item in named(load_odd(odd))}
    assert not canary.exists()
    assert len(found["metric", "./metric.py:Odd"]) == 64
    assert found["metric", "./missing.py:Odd"] == ""
    try:
        loaded = load_part("bombs:Planner", odd.parent)
    finally:
        sys.modules.pop("bombs", None)
    assert canary.exists()
    assert found["channel", "bombs:Planner"] == loaded.source_digest
