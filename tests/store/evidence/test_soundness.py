"""A quick look finds what would change the verdicts of a campaign, and says nothing of the rest."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from adeye.judge.stl.batch import NEEDED
from adeye.judge.verdict import ExitCode
from adeye.store.read.totals import gate_code
from tests.store.raw import guarded, unguarded

if TYPE_CHECKING:
    import sqlite3

    from adeye.store.repository import Repository


@pytest.fixture
def campaign(repository: Repository, example: Any) -> str:
    example.repeat(NEEDED)
    return str(example.campaign(repository, 8))


def tamper(raw: sqlite3.Connection, statement: str) -> None:
    """Change rows and leave the triggers as they were."""
    unguarded(raw)
    assert raw.execute(statement).rowcount > 0
    guarded(raw)


def test_untouched_campaign_is_sound(repository: Repository, campaign: str) -> None:
    assert repository.unsound(campaign) == ()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("statement", "table"),
    [
        ("UPDATE tally SET verdict = 'VACUOUS' WHERE fsr_id = 'FSR1'", "tally"),
        ("UPDATE tally SET runs = runs + 1", "tally"),
        ("UPDATE campaign_fsr SET mandatory = 0", "campaign_fsr"),
        ("UPDATE campaign_fsr SET min_exercised = 0", "campaign_fsr"),
        ("UPDATE campaign SET gate = '[]'", "campaign"),
        ("UPDATE campaign SET planned = 4", "campaign"),
        ("DELETE FROM campaign_case WHERE ordinal = 3", "campaign_case"),
        ("DELETE FROM work", "work"),
        ("UPDATE work SET to_ordinal = to_ordinal - 1", "work"),
        ("DELETE FROM run WHERE number = 2", "run"),
        ("UPDATE case_repeat SET passed = 0", "case_repeat"),
        ("DELETE FROM case_repeat", "case_repeat"),
        ("DELETE FROM case_repeat WHERE scenario = '' AND architecture = 'new'", "case_repeat"),
        ("UPDATE never_held SET decides = 0", "never_held"),
        ("DELETE FROM never_held WHERE architecture = 'new'", "case_repeat"),
    ],
)
def test_what_changes_a_verdict_is_named_and_ends_the_gate(
    repository: Repository, campaign: str, raw: sqlite3.Connection, statement: str, table: str
) -> None:
    tamper(raw, statement)
    assert table in {item.table for item in repository.unsound(campaign)}
    info = repository.find_campaign(campaign)
    code, message = gate_code(repository, info)
    assert code is ExitCode.INTEGRITY
    assert table in message


def test_dropped_trigger_is_named(
    repository: Repository, campaign: str, raw: sqlite3.Connection
) -> None:
    raw.execute("DROP TRIGGER tally_no_update")
    assert [str(item) for item in repository.unsound(campaign)] == [
        "schema tally_no_update: is missing"
    ]


def test_other_campaigns_are_not_looked_at(
    repository: Repository, campaign: str, example: Any, raw: sqlite3.Connection
) -> None:
    example.with_odd("2")
    other = str(example.campaign(repository, 4))
    tamper(raw, f"UPDATE tally SET runs = runs + 1 WHERE campaign_id = '{other}'")  # noqa: S608
    assert repository.unsound(campaign) == ()
    assert repository.unsound(other) != ()
