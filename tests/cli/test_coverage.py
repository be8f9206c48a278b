"""``coverage``: a table, a JSON document, and what it refuses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from adeye.spec.load import shipped

if TYPE_CHECKING:
    from tests.project import Executed

ODD = str(shipped("odd") / "motorway_chauffeur.yaml")


@pytest.mark.slow
def test_plan_is_told_with_its_gaps(adeye: Any) -> None:
    ended = adeye("coverage", ODD)
    assert ended.code == 0, ended.err
    lines = ended.out.splitlines()
    assert lines[0] == "ODD motorway_chauffeur: 228 of 228 planned test cases count"
    (rain,) = [line for line in lines if line.startswith(" rain ")]
    assert "0.1 to 2.5 mm/h" in rain
    assert "feasible pairs are covered" in ended.out
    assert "--json lists all" in ended.out


@pytest.mark.slow
def test_json_lists_every_uncovered_pair(adeye: Any) -> None:
    document = adeye("coverage", ODD, "--json").document
    assert document["schema"] == "adeye/coverage@1"
    parts = document["table"]["coverage"]["combinations"]
    assert len(parts) == 7 + 21
    assert all(item["feasible"] == item["covered"] + len(item["uncovered"]) for item in parts)


@pytest.mark.slow
def test_strength_one_has_no_pairs(adeye: Any) -> None:
    assert "pairs" not in adeye("coverage", ODD, "--strength", "1").out


def test_campaign_is_found_by_its_number(adeye: Any, mini: Executed) -> None:
    ended = adeye("coverage", "1", "--db", str(mini.db))
    assert ended.code == 0, ended.err
    assert ended.out.startswith(f"Campaign {mini.summary.campaign[:10]} of mini: ")


def test_unknown_campaign_and_odd_are_input_errors(adeye: Any, mini: Executed) -> None:
    assert adeye("coverage", "77", "--db", str(mini.db)).code == 2
    assert adeye("coverage", "odd/none.yaml").code == 2
