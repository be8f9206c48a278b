"""Former places of modules lead to the present ones, and say so."""

import sys
from importlib import import_module
from pathlib import Path

import pytest

import adeye
from adeye.former import former
from tests.refusals import refused

ROOT = Path(__file__).resolve().parents[1]


def test_every_present_place_is_there_and_no_former_one_is() -> None:
    def is_there(name: str) -> bool:
        path = ROOT.joinpath(*name.split("."))
        return path.with_suffix(".py").is_file() or (path / "__init__.py").is_file()

    assert len(former()) > 500
    assert [new for new in former().values() if not is_there(new)] == []
    assert [old for old in former() if is_there(old)] == []


def test_former_place_is_the_present_module_with_a_warning(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    present = import_module("adeye.simulate.engine")
    monkeypatch.delitem(sys.modules, "adeye.engine", raising=False)
    with pytest.warns(FutureWarning, match=r"adeye\.engine is adeye\.simulate\.engine now"):
        assert import_module("adeye.engine") is present
    assert (present.__name__, present.__spec__.name) == ("adeye.simulate.engine",) * 2  # type: ignore[union-attr]
    monkeypatch.delitem(sys.modules, "adeye.engine", raising=False)
    monkeypatch.delattr(adeye, "engine", raising=False)


def test_place_that_never_was_is_still_unknown() -> None:
    refused(ModuleNotFoundError, import_module, "adeye.nowhere", says=r"adeye\.nowhere")
