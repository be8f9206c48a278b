"""``warmup``: which ODDs are compiled for, and what is said."""

from pathlib import Path
from typing import Any

import pytest

import adeye.campaign.plan
import adeye.campaign.warmup
from adeye.cli.run import SHIPPED
from adeye.kernel.jit import cache_directory
from adeye.spec.load import shipped


class Warm:
    """Stands for planning and compiling; remembers what was asked."""

    def __init__(self) -> None:
        self.plans: list[tuple[Path, dict[str, Any]]] = []

    def make_plan(self, path: Path, **options: Any) -> str:
        self.plans.append((path, options))
        return path.name

    def warm_up(self, _plan: str, _progress: Any, *, aside: bool) -> float:
        assert isinstance(aside, bool)
        return 2.0


@pytest.fixture
def warm(monkeypatch: pytest.MonkeyPatch) -> Warm:
    fake = Warm()
    monkeypatch.setattr(adeye.campaign.plan, "make_plan", fake.make_plan)
    monkeypatch.setattr(adeye.campaign.warmup, "warm_up", fake.warm_up)
    return fake


def test_shipped_odds_are_compiled_for_unless_some_are_named(adeye: Any, warm: Warm) -> None:
    ended = adeye("warmup")
    assert ended.code == 0, ended.err
    assert [path for path, _ in warm.plans] == [shipped("odd") / name for name in SHIPPED]
    assert all(path.is_file() for path, _ in warm.plans)
    assert f"Compiled in 4 s, kept in {cache_directory()}" in ended.out


def test_named_odds_and_options_are_passed_on(adeye: Any, warm: Warm) -> None:
    document = adeye("warmup", "a.yaml", "b.yaml", "--variant", "fast", "--json").document
    options = {"backend": "batch", "variant": "fast"}
    assert warm.plans == [(Path("a.yaml"), options), (Path("b.yaml"), options)]
    assert document["schema"] == "adeye/warmup@1"
    assert (document["odds"], document["seconds"]) == (["a.yaml", "b.yaml"], 4.0)


def test_odd_that_does_not_exist_is_an_input_error(adeye: Any) -> None:
    assert adeye("warmup", "nowhere.yaml").code == 2
