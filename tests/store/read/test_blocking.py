"""Without evidence, and without a gate that asks, nothing is set aside."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from adeye.judge.verdict import Verdict
from adeye.store.read.totals import preventable_by, without_unpreventable


def repository(odd: Any, failures: Any = (), counts: Any = None) -> Any:
    status = SimpleNamespace(
        fsr="FSR-01",
        architecture="a",
        counts=counts or {Verdict.FAIL: 1, Verdict.PASS: 2},
        min_exercised=1,
        waived_until=None,
        repeated_passes=0,
    )
    benchmarks = SimpleNamespace(failures=lambda *_: list(failures))
    return SimpleNamespace(
        content=lambda *_: {"odd": odd},
        gate=lambda _: (status,),
        hindsight=SimpleNamespace(benchmarks=benchmarks),
    )


CAMPAIGN: Any = SimpleNamespace(id="c", number=3, odd_digest="d")


@pytest.mark.parametrize(
    ("odd", "models"),
    [
        ({"gate": {"architectures": ["a"], "preventable_by": ["cc"]}}, ("cc",)),
        ({"gate": {"architectures": ["a"]}}, ()),
        ({"gate": None}, ()),
        ({}, ()),
        ("motorway", ()),
    ],
)
def test_models_are_those_of_the_gate(odd: Any, models: tuple[str, ...]) -> None:
    assert preventable_by(repository(odd), CAMPAIGN) == models


@pytest.mark.parametrize(
    ("failures", "verdict", "note"),
    [
        ([{"cc": "neither"}], Verdict.PASS, "not blocking: unpreventable by cc (1 run)"),
        ([{"cc": "only_model"}], Verdict.FAIL, ""),
        ([{}], Verdict.FAIL, ""),
        (
            [{"": "unknown"}],
            Verdict.FAIL,
            "1 run not known to be unpreventable by cc: run `adeye preventability 3 --model cc`",
        ),
    ],
)
def test_notes(failures: Any, verdict: Verdict, note: str) -> None:
    found = without_unpreventable(repository({}, failures), CAMPAIGN, "FSR-01", "a", ["cc"])
    assert found == (verdict, note)
