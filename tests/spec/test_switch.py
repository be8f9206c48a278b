"""Switches: which keys a policy knows and needs, channels that are listed, and identity."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.quantity import SI
from adeye.spec.switch import KEYS, NEEDED, Switch
from tests.stored import stored

TABLES = stored("definitions")


PLAIN: dict[str, Any] = {
    "policy": "fixed_priority",
    "priority": ["safety", "nominal", "spare"],
    "default": "nominal",
}
RETURNS: dict[str, Any] = {**PLAIN, "policy": "hysteresis", "return_after": "2 s"}
VOTES: dict[str, Any] = {
    **PLAIN,
    "policy": "voting",
    "voters": ["safety", "nominal", "spare"],
    "acceleration_tolerance": "1 m/s^2",
    "steering_tolerance": "2 deg",
}
FULL: dict[str, Any] = {
    **VOTES,
    "debounce": "0.1 s",
    "latch": False,
    "quorum": 3,
    "vote": "median",
    "without_majority": "safety",
    "handover": "0.1 s",
    "meanwhile": "coast",
    "bumpless": {"jerk": "10 m/s^3", "steering_rate": "20 deg/s"},
}


def errors(content: dict[str, Any]) -> list[tuple[tuple[int | str, ...], str]]:
    """Return place and message of everything that is refused."""
    with pytest.raises(ValidationError) as caught:
        Switch.model_validate(content)
    return [(item["loc"], item["msg"]) for item in caught.value.errors()]


def test_every_key_belongs_to_a_policy_that_is_not_stuck() -> None:
    used = set().union(*(KEYS[name] for name in KEYS if name != "stuck"))
    assert used == set(Switch.model_fields) == KEYS["stuck"]
    assert all(set(keys) <= KEYS[name] for name, keys in NEEDED.items())


@pytest.mark.parametrize(
    ("content", "key"),
    [
        ({**PLAIN, "return_after": "1 s"}, "return_after"),
        ({**PLAIN, "quorum": 2}, "quorum"),
        ({**RETURNS, "latch": True}, "latch"),
        ({**RETURNS, "vote": "majority"}, "vote"),
        ({**VOTES, "return_degraded": False}, "return_degraded"),
    ],
)
def test_key_that_the_policy_does_not_know_is_refused_even_with_its_default(
    content: dict[str, Any], key: str
) -> None:
    ((loc, message),) = errors(content)
    assert loc == (key,)
    assert f"{key} is no key of the policy {content['policy']}; its keys are policy, " in message


@pytest.mark.parametrize("content", [RETURNS, VOTES])
def test_key_that_the_policy_needs_is_asked_for(content: dict[str, Any]) -> None:
    needed = NEEDED[content["policy"]]
    without = {key: value for key, value in content.items() if key not in needed}
    assert [message for _, message in errors(without)] == [
        f"{content['policy']} needs {key}" for key in needed
    ]


@pytest.mark.parametrize("content", [PLAIN, RETURNS, VOTES, FULL])
def test_any_policy_can_be_set_to_stuck_with_its_keys_left_in_the_file(
    content: dict[str, Any],
) -> None:
    assert Switch.model_validate({**content, "policy": "stuck"}).default == "nominal"


@pytest.mark.parametrize(
    ("changes", "loc", "said"), TABLES["impossible value is refused at its place"]
)
def test_impossible_value_is_refused_at_its_place(
    changes: dict[str, Any], loc: list[str | int], said: str
) -> None:
    ((found, message),) = errors({**VOTES, **changes})
    assert found == tuple(loc)
    assert said in message


def test_half_of_the_voters_is_no_majority() -> None:
    four = ["safety", "nominal", "spare", "other"]
    ((loc, message),) = errors({**VOTES, "priority": four, "voters": four, "quorum": 2})
    assert loc == ("quorum",)
    assert "2 of 4 voters is no majority; give 3 to 4" in message


@pytest.mark.parametrize(
    ("voters", "quorum", "agreeing"), [(2, None, 2), (3, None, 2), (4, None, 3), (3, 3, 3)]
)
def test_more_than_half_must_agree(voters: int, quorum: int | None, agreeing: int) -> None:
    names = ["nominal", "safety", "spare", "other"][:voters]
    content = {**VOTES, "priority": names, "voters": names}
    if quorum is not None:
        content["quorum"] = quorum
    assert Switch.model_validate(content).agreeing == agreeing


@pytest.mark.parametrize("content", [PLAIN, RETURNS, VOTES, FULL, {**FULL, "policy": "stuck"}])
def test_stored_switch_reads_back(content: dict[str, Any]) -> None:
    read = Switch.model_validate(content)
    assert Switch.model_validate(read.model_dump(mode="json"), context=SI) == read


def test_what_does_without_the_later_keys_is_stored_as_it_was() -> None:
    stored = {
        "policy": "fixed_priority",
        "priority": ["safety", "nominal", "spare"],
        "default": "nominal",
        "debounce": 0.0,
        "latch": True,
        "staleness": 0.2,
        "realises": None,
    }
    assert Switch.model_validate(PLAIN).model_dump(mode="json") == stored
    written = {**PLAIN, "handover": "0 s", "meanwhile": "keep"}
    assert Switch.model_validate(written).model_dump(mode="json") == stored
    stuck = Switch.model_validate({**PLAIN, "policy": "stuck"}).model_dump(mode="json")
    assert stuck == {**stored, "policy": "stuck"}


@pytest.mark.parametrize("changes", TABLES["what changes the decisions is stored"])
def test_what_changes_the_decisions_is_stored(changes: dict[str, Any]) -> None:
    full = {**FULL, "quorum": 3}
    changed = Switch.model_validate({**full, **changes}).model_dump(mode="json")
    assert changed != Switch.model_validate(full).model_dump(mode="json")
