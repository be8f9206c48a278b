"""What a comparison may be asked, and what is refused with what is allowed."""

from __future__ import annotations

from typing import Any

import pytest

from adeye.errors import UsageError
from adeye.report.comparison.records import CompareOptions

KNOWN = ("camera_radar", "twin", "legacy_camera")


def ask(options: CompareOptions) -> None:
    """Check everything that a comparison checks before it reads a test case."""
    options.chosen(KNOWN)
    options.check()


def test_all_are_compared_in_the_order_of_the_odd_unless_said() -> None:
    assert CompareOptions().chosen(KNOWN) == list(KNOWN)
    assert CompareOptions(("twin", "camera_radar", "twin")).chosen(KNOWN) == [
        "camera_radar",
        "twin",
    ]


def test_baseline_comes_first_and_need_not_be_named_twice() -> None:
    options = CompareOptions(("camera_radar",), baseline="legacy_camera")
    assert options.chosen(KNOWN) == ["legacy_camera", "camera_radar"]


def test_what_is_measured_by_default_is_allowed() -> None:
    CompareOptions().check()
    CompareOptions(objectives=("margin", "cost"), epsilon={"margin": 0.0, "cost": 20.0}).check()


@pytest.mark.parametrize(
    ("options", "part"),
    [
        ({"architectures": ("camera_radr", "twin")}, "Did you mean 'camera_radar'"),
        ({"architectures": ("twin",)}, "nothing to compare 'twin' with"),
        ({"baseline": "unheard_of"}, "no architecture 'unheard_of'"),
        ({"confidence": 1.0}, "confidence is 1"),
        ({"objectives": ("price",)}, "no objective 'price'"),
        ({"objectives": ()}, "no objective is given"),
        ({"objectives": ("cost", "failures", "cost")}, "'cost' is given twice"),
        ({"epsilon": {"cost": -1.0}}, "epsilon of cost is -1"),
        ({"epsilon": {"cost": float("nan")}}, "epsilon of cost is nan"),
        ({"epsilon": {"cost": float("inf")}}, "epsilon of cost is inf. Give a finite number"),
        ({"epsilon": {"margin": 1.0}}, "epsilon of margin has no effect"),
        ({"epsilon": {"prize": 1.0}}, "no objective 'prize'"),
    ],
)
def test_wrong_question_is_refused(options: Any, part: str) -> None:
    with pytest.raises(UsageError, match=part):
        ask(CompareOptions(**options))
