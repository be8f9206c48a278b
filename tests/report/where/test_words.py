"""Conditions on swept values, written and read again."""

import numpy as np
import pytest

from adeye.campaign.selection import MAX_LENGTH, Keyword
from adeye.report.where.words import LONGEST, Words, keyword
from adeye.spec.expression import parse
from adeye.sweep.values import quantity_or_text

SPEEDS = tuple(quantity_or_text(f"{speed} km/h")[0] for speed in (80, 100, 110, 130))
DRAWN = tuple(np.random.default_rng(5).uniform(-40.0, 60.0, 50).tolist())


@pytest.mark.parametrize(
    ("words", "first", "last", "said"),
    [
        (Words.of("ego_speed", SPEEDS, "100 km/h"), 1, 3, "ego_speed >= 100 km/h"),
        (Words.of("ego_speed", SPEEDS, "100 km/h"), 2, 2, "ego_speed == 110 km/h"),
        (Words.of("gap", (30.0, -3.0, 4.5), "1 m"), 0, 1, "gap <= 4.5 m"),
        (Words.of("rain", (0.0, 7.5 / 3.6e6), "7.5 mm/h"), 1, 1, "rain == 7.5 mm/h"),
        (Words.of("cars", (1, 2, 3), 2), 1, 1, "cars == 2"),
        (Words.of("light", ("night", "day", "dusk"), "day"), 0, 1, "light != 'night'"),
        (Words.of("light", ("night", "o'clock"), "day"), 1, 1, 'light == "o\'clock"'),
        (Words.of("a.b", (1.0, 2.0, 3.0, 4.0), 1), 1, 2, "a.b >= 2 and a.b <= 3"),
    ],
)
def test_condition_is_short_and_in_the_unit_of_the_odd(
    words: Words, first: int, last: int, said: str
) -> None:
    places = np.arange(len(words.values))
    levels = (places >= first) & (places <= last)
    assert words.condition(levels) == said
    assert parse(said).evaluate({words.name: np.array(words.values)}).tolist() == levels.tolist()


@pytest.mark.parametrize("unit", ["1 m", "1 km/h", "1 deg", "2"])
def test_condition_on_drawn_values_holds_exactly_where_it_is_said_to(unit: str) -> None:
    words = Words.of("gap", DRAWN, unit)
    places = np.arange(len(DRAWN))
    for first, last in ((0, 20), (7, 7), (31, 49), (12, 30)):
        levels = (places >= first) & (places <= last)
        text = words.condition(levels)
        assert parse(text).evaluate({"gap": np.array(words.values)}).tolist() == levels.tolist()
        # Nobody reads seventeen digits.
        assert len(text) < 60


def test_what_k_does_not_take_is_not_said() -> None:
    assert LONGEST == MAX_LENGTH
    few = Words.of("gap", (1.0, 2.0), "1 m")
    both = np.array([True, True])
    assert Keyword.parse(keyword("a", "b", [(few, both)])).text.endswith('"gap=2 m")')
    drawn, quoted = Words.of("gap", DRAWN, "1 m"), Words.of("light", ('a"b', "c"), "c")
    long = Words.of("light", tuple(f"{number}" * 200 for number in range(9)), "c")
    for words in (drawn, quoted, long):
        levels = np.ones(len(words.values), dtype=np.bool_)
        assert keyword("a", "b", [(words, levels)]) == ""
