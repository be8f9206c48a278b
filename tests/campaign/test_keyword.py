"""Words, what joins them, and what is refused."""

from __future__ import annotations

import pytest

from adeye.campaign.selection import MAX_DEPTH, MAX_LENGTH, Keyword
from adeye.errors import UsageError
from adeye.store.write.queue import NamedCase

CASE = NamedCase(
    "cut_in",
    "camera_radar",
    "front_camera_out+nominal_silent",
    2,
    '{"gap":30.0,"lane":1,"kind":"Van","architecture.sensors.front_radar.range":150.0,"wet":true}',
)


@pytest.mark.parametrize(
    "text",
    [
        "cut_in",
        "CUT_IN",
        "cut and radar",
        "nominal_silent",
        "not lead_braking",
        "not not cut_in",
        "lead or cut",
        "cut_in and not (legacy or gap=50)",
        "gap=30",
        "gap=30.0",
        'gap="30 m"',
        '"gap=3000 cm"',
        "front_radar.range=150",
        "range=150",
        "kind=van",
        "wet=true",
        "lane=1",
        "scenario=cut_in",
        "architecture=camera_radar",
        "replicate=2",
        "fault=front_camera_out+nominal_silent",
        "lead and cut or cut_in",
        "cut_in or lead and nothing",
        "( cut_in )",
        "gap=3 or gap",
    ],
)
def test_chooses(text: str) -> None:
    assert Keyword.parse(text).matches(CASE)


@pytest.mark.parametrize(
    "text",
    [
        "lead",
        "not cut_in",
        "cut_in and legacy",
        "gap=3",
        "gap=300",
        "ap=30",
        "gap=",
        "kind=va",
        "lane=true",
        "scenario=cut",
        "architecture=camera",
        "unknown=1",
        "not (cut_in or lead)",
        "cut_in and not (lead or radar)",
        "lead or cut_in and legacy",
    ],
)
def test_does_not_choose(text: str) -> None:
    assert not Keyword.parse(text).matches(CASE)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "lacks a word"),
        ("and", "lacks a word"),
        ("a and", "lacks a word"),
        ("not", "lacks a word"),
        ("()", "lacks a word"),
        ("a b", "has 'b' where"),
        ("a)", "has ')' where"),
        ("(a", "parenthesis"),
        ('"a', "quote"),
        ("(" * (MAX_DEPTH + 2) + "a" + ")" * (MAX_DEPTH + 2), "nested"),
        ("not " * (MAX_DEPTH + 2) + "a", "nested"),
        ("a" * (MAX_LENGTH + 1), "longer than"),
    ],
)
def test_refuses(text: str, why: str) -> None:
    with pytest.raises(UsageError) as refused:
        Keyword.parse(text)
    assert why in str(refused.value)
    assert "Write words joined by" in str(refused.value)


def test_words_of_the_language_are_plain_words_in_quotes() -> None:
    named = NamedCase("and", "or", "none", 0, "{}")
    assert Keyword.parse('"and" and "or"').matches(named)
    assert not Keyword.parse('"not"').matches(named)
