"""R2: one command runs a catalogue over several roads, and goes on after an interruption."""

from typing import Any

import pytest

import adeye
from adeye.campaign.run import Progress
from adeye.cli.app import main
from tests.conftest import MakeProject
from tests.project import odd_of, table_hash, use
from tests.refusals import refused

pytestmark = pytest.mark.requirements

CATALOGUE = odd_of(
    "cut_in",
    "cut_in_on_a_bend",
    use("lead_braking", {"ego_speed": ["60 km/h", "80 km/h"]}),
)
BEND: dict[str, Any] = {
    "extends": "cut_in",
    "scenario": "cut_in_on_a_bend",
    "title": "Cut-in on a bend",
    "world": {"road": {"kind": "curve", "radius": "1500 m"}},
}


@pytest.mark.slow
def test_one_command_runs_a_catalogue_over_several_roads_and_resumes(
    make_project: MakeProject,
) -> None:
    project = make_project(CATALOGUE)
    project.write("scenarios_db/motorway/cut_in_on_a_bend.yaml", BEND)

    def stop(state: Progress) -> None:
        if state.done:
            raise KeyboardInterrupt

    refused(KeyboardInterrupt, adeye.run, project.odd, db=project.db, progress=stop)
    begun = len(project.rows())
    assert 0 < begun < 4
    command = ["run", str(project.odd), "--db", str(project.db), "--workers", "1", "--quiet"]
    main(command)
    rows = project.rows()
    names = ["cut_in", "cut_in_on_a_bend", "lead_braking", "lead_braking"]
    assert [row["scenario"] for row in rows] == names
    # The two roads lead to two drives.
    assert rows[0]["trace_digest"] != rows[1]["trace_digest"]
    finished = table_hash(project.db)
    main(command)
    assert adeye.run(project.odd, db=project.db).executed == 0
    assert table_hash(project.db) == finished


@pytest.mark.slow
def test_a_new_point_executes_only_what_is_new(make_project: MakeProject) -> None:
    project = make_project()
    first = project.run()
    with project.edited_odd() as odd:
        odd["scenarios"][1]["sweep"]["parameters"]["deceleration"].append("5 m/s^2")
    second = project.run()
    assert second.planned - first.planned == second.executed == 2
