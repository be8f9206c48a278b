"""Records of an analysis: sums and the worst condition."""

from adeye.analysis.suite.analyse import analyse
from adeye.analysis.suite.records import Chain
from tests.analysis.suite.rigs import BUMPER, architecture, radar


def test_total_wait_is_the_sum() -> None:
    chain = Chain("a", "b", 0.1, 0.2, 0.3, 0.4, 8.0, is_assumed=False)
    assert chain.total_s == 1.0


def test_worst_condition_is_the_one_in_which_least_is_seen() -> None:
    camera = {
        "kind": "camera",
        "mount": BUMPER,
        "field_of_view": 1.0,
        "range": 80.0,
        "rate": 20.0,
        "night_range": 0.3,
    }
    assert analyse(architecture({"eye": camera})).worst.id == "night"
    assert analyse(architecture({"eye": radar()})).worst.id == "dry_day"
