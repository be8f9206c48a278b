"""What TAB offers; errors offer nothing."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from adeye.cli import options as completion
from adeye.store.read import query


def context(**params: Any) -> Any:
    return SimpleNamespace(params=params)


def test_scenarios_of_the_shipped_catalogue(folder: Path) -> None:
    assert folder.is_dir()
    assert ("cut_in", "motorway") in completion.complete_scenarios(context(), "cut")


def test_only_what_begins_so(folder: Path) -> None:
    assert folder.is_dir()
    offers = completion.complete_scenarios(context(), "lead")
    assert [name for name, _ in offers] == ["lead_braking"]


def test_queries() -> None:
    assert [name for name, _ in completion.complete_queries(context(), "worst")] == ["worst-runs"]


def test_runs_and_campaigns_come_from_the_database(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[Any, str]] = []

    def run_query(db: Any, sql: str, **_options: Any) -> query.QueryResult:
        asked.append((db, sql))
        return query.QueryResult(("a", "b"), (("abcd", "cut_in\x1b x"), (7, "first")), is_cut=False)

    monkeypatch.setattr(query, "run_query", run_query)
    assert completion.complete_runs(context(db="x.db"), "ab") == [("abcd", "cut_in x")]
    assert completion.complete_campaigns(context(), "7") == [("7", "first")]
    assert asked[0][0] == "x.db"
    assert "LIKE 'ab%'" in asked[0][1]


def test_quotes_do_not_reach_the_statement(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    monkeypatch.setattr(query, "run_query", lambda _db, sql, **_o: asked.append(sql))
    assert completion.complete_runs(context(), "a' --") == []
    assert "LIKE 'a%'" in asked[0]


@pytest.mark.parametrize("complete", [completion.complete_runs, completion.complete_campaigns])
def test_no_database_offers_nothing_and_makes_none(folder: Path, complete: Any) -> None:
    assert complete(context(), "") == []
    assert list(folder.iterdir()) == []
