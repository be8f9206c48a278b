"""Former places of modules name the present ones; a few still lead there."""

import re
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


@pytest.mark.filterwarnings("ignore::FutureWarning")
@pytest.mark.parametrize("name", ["adeye.campaign.blocks", "adeye.traffic.batch"])
def test_former_place_is_an_error_that_names_the_present_one(name: str) -> None:
    message = re.escape(f"{name} is {former()[name]} now")
    refused(ModuleNotFoundError, import_module, name, says=message)


def test_place_of_handed_out_scripts_is_the_present_module_with_a_warning(
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
