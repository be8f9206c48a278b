"""R2: one command runs a catalogue of scenarios and goes on where it stopped."""

from __future__ import annotations

import pytest

from tests.conftest import MakeProject
from tests.project import table_hash

pytestmark = pytest.mark.requirements


def test_one_command_runs_every_scenario_and_a_second_one_nothing(
    make_project: MakeProject,
) -> None:
    project = make_project()
    first = project.run()
    assert {row["scenario"] for row in project.rows()} == {"cut_in", "lead_braking"}
    before = table_hash(project.db)
    second = project.run()
    assert (first.executed, second.executed) == (first.planned, 0)
    assert table_hash(project.db) == before


def test_a_new_point_executes_only_what_is_new(make_project: MakeProject) -> None:
    project = make_project()
    first = project.run()
    with project.edited_odd() as odd:
        odd["scenarios"][1]["sweep"]["parameters"]["deceleration"].append("5 m/s^2")
    second = project.run()
    assert second.planned - first.planned == second.executed == 2
