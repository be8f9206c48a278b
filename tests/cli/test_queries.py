"""Saved queries: names, and that each is one statement about one campaign."""

import re

import pytest

from adeye.cli.queries import SAVED


def test_the_promised_ones_are_there() -> None:
    assert SAVED.keys() >= {
        "failing-fsrs",
        "worst-runs",
        "fault-coverage",
        "architecture-pairs",
        "metrics-by-architecture",
        "least-slack",
        "undetected-faults",
        "unexercised",
        "evidence-by-element",
    }


@pytest.mark.parametrize("name", SAVED)
def test_query_is_one_complete_statement_with_a_plain_name(name: str) -> None:
    query = SAVED[name]
    assert query.name == name
    assert re.fullmatch(r"[a-z-]+", name)
    assert query.text
    assert "$" not in query.sql
    assert ";" not in query.sql
    assert "ORDER BY" in query.sql


@pytest.mark.parametrize("name", SAVED.keys() - {"campaigns"})
def test_query_is_about_the_latest_campaign(name: str) -> None:
    assert "(SELECT campaign FROM v_campaigns WHERE recency = 1)" in SAVED[name].sql
