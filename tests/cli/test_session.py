"""Options of a session: times, and what cannot be read."""

import math
from typing import Any

import pytest

from adeye.cli.options import make_session, seconds
from adeye.errors import UsageError

NOTHING: dict[str, Any] = {
    "shard": None,
    "keyword": None,
    "last_failed": False,
    "maxfail": None,
    "budget": None,
    "deadline": None,
}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("8h", 28_800.0),
        ("90m", 5_400.0),
        ("90min", 5_400.0),
        ("30s", 30.0),
        ("1h30m", 5_400.0),
        ("1 h 30 min", 5_400.0),
        ("1d", 86_400.0),
        ("1.5 h", 5_400.0),
        ("1h1m1s", 3_661.0),
    ],
)
def test_times_of_people(text: str, expected: float) -> None:
    assert seconds(text, "--budget") == expected


@pytest.mark.parametrize(
    "text", ["", "8", "h", "8 hours", "0s", "-1h", "1e3s", "nan", "1h30", "1hm", "inf", "8h!"]
)
def test_what_is_no_time_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="--budget is") as refused:
        seconds(text, "--budget")
    assert "such as 8h" in str(refused.value)


def test_nothing_given_leaves_nothing_out() -> None:
    session = make_session(**NOTHING)
    assert session.choice.is_everything
    assert session.limits.budget_s == math.inf
    assert session.limits.most_failures is None


def test_what_is_given_arrives() -> None:
    given: dict[str, Any] = {
        "shard": "2/3",
        "keyword": "cut_in",
        "last_failed": True,
        "maxfail": 5,
        "budget": "8h",
        "deadline": "10m",
    }
    session = make_session(**given)
    assert session.choice.text == "--shard 2/3 -k 'cut_in' --last-failed"
    assert (session.limits.budget_s, session.limits.most_failures) == (28_800.0, 5)
    assert session.deadline_s == 600.0


@pytest.mark.parametrize(
    ("option", "value"),
    [("--shard", "4/3"), ("-k", "a b"), ("--budget", "long"), ("--deadline", "0s")],
)
def test_what_cannot_be_read_is_an_input_error_before_anything_runs(
    adeye: Any, option: str, value: str
) -> None:
    ended = adeye("run", "none.yaml", option, value)
    assert ended.code == 2
    assert option in ended.err
    assert "none.yaml" not in ended.err
