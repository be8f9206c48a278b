import sqlite3
from typing import Any

import pytest

from adeye.store import catalogue as catalog
from adeye.store.repository import Repository
from adeye.store.views import identifier


def columns(raw: sqlite3.Connection, view: str) -> list[str]:
    return [item[0] for item in raw.execute(f"SELECT * FROM {view}").description]  # noqa: S608


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("cut_in", "cut_in"),
        ("Cut In!", "cut_in"),
        ("9 lives", "x_9_lives"),
        ("'; DROP TABLE run; --", "drop_table_run"),
        ("", "x_"),
        ("é", "x_"),
    ],
)
def test_identifier_is_safe_whatever_the_text(text: str, name: str) -> None:
    assert identifier(text) == name


def test_each_parameter_is_a_typed_column_with_its_unit(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    example.campaign(repository, 8)
    found = raw.execute("SELECT ego_speed_mps FROM v_runs_cut_in ORDER BY ordinal").fetchall()
    assert found == [(20.0,), (20.0,), (21.0,), (21.0,)]
    assert {type(value) for (value,) in found} == {float}
    assert "ego_speed" in columns(raw, "v_runs_braking")


def test_view_follows_new_parameters(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    example.campaign(repository, 4)
    assert "gap" not in columns(raw, "v_runs_cut_in")
    case = example.case(
        0,
        test_case="a" * 64,
        parameters={"ego_speed": 20.0, "gap": 7.0},
        point={"gap": 7.0, "architecture.sensors.camera.kind": "wide"},
    )
    plan = repository.plan_campaign(example.record(), [case])
    example.work_off(repository, plan.campaign)
    found = raw.execute(
        "SELECT gap, architecture_sensors_camera_kind FROM v_runs_cut_in WHERE campaign = ?",
        (plan.campaign,),
    ).fetchall()
    assert found == [(7.0, "wide")]


def test_parameter_named_like_a_column_gets_a_name_of_its_own(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    case = example.case(0, parameters={"outcome": 1.0, "a.b": 2.0, "a_b": 3.0}, point={})
    plan = repository.plan_campaign(example.record(), [case])
    example.work_off(repository, plan.campaign)
    names = columns(raw, "v_runs_cut_in")
    assert len(names) == len(set(names))
    assert sum(name.startswith("outcome") for name in names) == 2
    assert sum(name.startswith("a_b") for name in names) == 2
    assert raw.execute("SELECT outcome FROM v_runs_cut_in").fetchall() == [("completed",)]


def test_scenarios_with_one_identifier_get_two_views(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    cases = [example.case(0), example.case(4, scenario="Cut-In")]
    plan = repository.plan_campaign(example.record(), cases)
    example.work_off(repository, plan.campaign)
    with repository._database.read() as connection:
        views = [name for name in catalog.views(connection) if name.startswith("v_runs_cut_in")]
    assert len(views) == 2
    for view in views:
        assert len(raw.execute(f"SELECT * FROM {view}").fetchall()) == 1  # noqa: S608


@pytest.mark.slow
def test_hostile_names_make_no_sql(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    hostile = "x') FROM run; DROP TABLE run; --"
    cases = [
        example.case(0, parameters={hostile: 1.0}, point={hostile: "'"}),
        example.case(4, scenario=hostile),
    ]
    plan = repository.plan_campaign(example.record(), cases)
    assert example.work_off(repository, plan.campaign) == 2
    assert repository.verify() == ()
    assert len(raw.execute("SELECT * FROM v_runs_cut_in").fetchall()) == 1


@pytest.mark.parametrize("word", ["on", "order", "Group", "limit", "values", "null"])
def test_parameter_may_be_called_like_a_word_of_sql(
    repository: Repository, example: Any, raw: sqlite3.Connection, word: str
) -> None:
    plan = repository.plan_campaign(example.record(), [example.case(0, parameters={word: 1.5})])
    example.work_off(repository, plan.campaign)
    assert raw.execute(f'SELECT "{word.lower()}" FROM v_runs_cut_in').fetchall() == [(1.5,)]  # noqa: S608


@pytest.mark.slow
def test_long_names_that_differ_at_their_end_are_kept_apart(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    """A server cuts names to 63 bytes; scenarios and parameters have longer ones."""
    long = "x" * 63
    parameters = {f"{long}a": 1.0, f"{long}b": 2.0}
    cases = [
        example.case(at, scenario=f"{long}{end}", parameters=parameters, point={})
        for at, end in ((0, "a"), (4, "b"))
    ]
    for count in (1, 2):
        # The second plan finds the views of the first.
        plan = repository.plan_campaign(example.record(), cases[:count])
        example.work_off(repository, plan.campaign)
    with repository._database.read() as connection:
        views = [name for name in catalog.views(connection) if name.startswith("v_runs_x")]
    assert len(views) == 2
    for view in views:
        names = columns(raw, view)
        assert len([name for name in names if name.startswith("xxx")]) == 2
    assert repository.verify() == ()
