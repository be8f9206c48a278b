"""Ways to lose or to falsify evidence: each ends with its exit code and names its cause."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import pytest

from tests.chaos import inputs, missing, platform, stored

if TYPE_CHECKING:
    from tests.chaos.bench import Bench
    from tests.chaos.ways import Way

WAYS: Final[list[Way]] = [*inputs.WAYS, *missing.WAYS, *stored.WAYS, *platform.WAYS]


def marked(way: Way) -> object:
    return pytest.param(way, id=way.what, marks=[pytest.mark.slow] if way.is_slow else [])


@pytest.mark.parametrize("way", [marked(way) for way in WAYS])
def test_lost_or_false_evidence_is_never_green(bench: Bench, way: Way) -> None:
    said = way.do(bench)
    assert (said.code, way.said in said.text) == (way.code, True), said.text
    assert "defect of adeye" not in said.text
    assert "Traceback" not in said.text
