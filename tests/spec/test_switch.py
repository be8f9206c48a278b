"""Switches: which keys a policy knows and needs, channels that are listed, and identity."""

from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.architecture import POLICY_KEYS, POLICY_NEEDS, Switch
from adeye.spec.quantity import SI
from tests.refusals import refused
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
    caught = refused(ValidationError, Switch.model_validate, content)
    return [(item["loc"], item["msg"]) for item in caught.errors()]


def test_every_key_belongs_to_a_policy_that_is_not_stuck() -> None:
    used = set().union(*(POLICY_KEYS[name] for name in POLICY_KEYS if name != "stuck"))
    assert used == set(Switch.model_fields) == POLICY_KEYS["stuck"]
    assert all(set(keys) <= POLICY_KEYS[name] for name, keys in POLICY_NEEDS.items())


def test_key_that_the_policy_does_not_know_is_refused_even_with_its_default() -> None:
    for content, key in (
        ({**PLAIN, "return_after": "1 s"}, "return_after"),
        ({**PLAIN, "quorum": 2}, "quorum"),
        ({**RETURNS, "latch": True}, "latch"),
        ({**RETURNS, "vote": "majority"}, "vote"),
        ({**VOTES, "return_degraded": False}, "return_degraded"),
    ):
        ((loc, message),) = errors(content)
        assert loc == (key,), content
        assert (
            f"{key} is no key of the policy {content['policy']}; its keys are policy, " in message
        )


def test_key_that_the_policy_needs_is_asked_for() -> None:
    for content in (RETURNS, VOTES):
        policy = content["policy"]
        without = {key: value for key, value in content.items() if key not in POLICY_NEEDS[policy]}
        messages = [message for _, message in errors(without)]
        assert messages == [f"{policy} needs {key}" for key in POLICY_NEEDS[policy]]


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


def test_more_than_half_must_agree() -> None:
    for count, quorum, agreeing in ((2, {}, 2), (3, {}, 2), (4, {}, 3), (3, {"quorum": 3}, 3)):
        names = ["nominal", "safety", "spare", "other"][:count]
        content = {**VOTES, "priority": names, "voters": names, **quorum}
        assert Switch.model_validate(content).agreeing == agreeing


@pytest.mark.parametrize("content", [PLAIN, RETURNS, VOTES, FULL])
def test_stored_switch_reads_back_and_can_be_set_to_stuck_with_its_keys_left(
    content: dict[str, Any],
) -> None:
    for policy in (content["policy"], "stuck"):
        read = Switch.model_validate({**content, "policy": policy})
        assert Switch.model_validate(read.model_dump(mode="json"), context=SI) == read
        assert read.default == "nominal"


def test_what_does_without_the_later_keys_is_stored_as_it_was() -> None:
    defaults = {"debounce": 0.0, "latch": True, "staleness": 0.2, "realises": None}
    for later in ({}, {"handover": "0 s", "meanwhile": "keep"}, {"policy": "stuck"}):
        written = {**PLAIN, **later}
        stored = {**PLAIN, **defaults, "policy": written["policy"]}
        assert Switch.model_validate(written).model_dump(mode="json") == stored


@pytest.mark.parametrize("changes", TABLES["what changes the decisions is stored"])
def test_what_changes_the_decisions_is_stored(changes: dict[str, Any]) -> None:
    full = {**FULL, "quorum": 3}
    changed = Switch.model_validate({**full, **changes}).model_dump(mode="json")
    assert changed != Switch.model_validate(full).model_dump(mode="json")
