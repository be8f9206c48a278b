"""What a sweep writes into a scenario is wrong in the ODD, not in the scenario's file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from adeye.errors import InputError
from tests.project import MINI, Project

SCENARIO = "scenarios_db/motorway/cut_in.yaml"


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Project:
    return Project(tmp_path_factory.mktemp("authorship"))


def refusal(project: Project, **use: Any) -> tuple[InputError, str]:
    """Plan an ODD that uses a cut-in; return the error and the line of the file it points to."""
    project.write("odd/tested.yaml", {**MINI, "scenarios": [{"use": "cut_in", **use}]})
    with pytest.raises(InputError) as caught:
        project.plan()
    where = caught.value.where
    assert where is not None
    lines = Path(where.path).read_text("utf-8").splitlines()
    assert where.line <= len(lines)
    # A list stands in the line below its key.
    return caught.value, " ".join(lines[max(0, where.line - 2) : where.line])


@pytest.mark.parametrize(
    ("axis", "values", "part"),
    [
        ("scenario.environment.sun_elevation", ["200 deg"], "200 deg is beyond the zenith"),
        ("scenario.environment.fog_visibility", ["100 m", "0 m"], "0 m is not plausible"),
        ("scenario.environment.rain", ["-1 mm/h"], "environment.rain"),
        ("scenario.ego.lane", [7], "7 is no lane"),
    ],
)
def test_value_of_an_axis_is_wrong_at_the_axis(
    project: Project, axis: str, values: list[Any], part: str
) -> None:
    parameters = {"gap": ["30 m", "50 m"], axis: values, "lateral_speed": ["1 m/s"]}
    error, line = refusal(project, sweep={"parameters": parameters})
    assert str(project.odd) in str(error.where)
    assert part in error.message
    assert axis in line


def test_fixed_value_is_wrong_where_the_odd_gives_it(project: Project) -> None:
    name = "scenario.environment.sun_elevation"
    error, line = refusal(project, parameters={name: "200 deg"})
    assert str(project.odd) in str(error.where)
    assert f"{name}: 200 deg" in line


def test_formula_of_a_swept_parameter_is_wrong_at_the_parameter(tmp_path: Path) -> None:
    project = Project(tmp_path / "project")
    with project.edited(SCENARIO) as scenario:
        scenario["parameters"]["friction"]["range"] = [0, 1]
    sweep = {"parameters": {"gap": ["30 m"], "friction": [0.5, 0], "rain": ["0 mm/h"]}}
    error, line = refusal(project, sweep=sweep)
    assert str(project.odd) in str(error.where)
    assert "environment.friction: 0" in error.message
    assert "friction" in line


def test_what_is_wrong_together_is_wrong_where_the_odd_has_its_part(tmp_path: Path) -> None:
    project = Project(tmp_path / "project")
    with project.edited(SCENARIO) as scenario:
        scenario["environment"]["sun_elevation"] = "20 deg"
    axis = "scenario.environment.illumination"
    error, line = refusal(project, sweep={"parameters": {axis: ["day", "night"]}})
    assert "the illumination is not day" in error.message
    assert str(project.odd) in str(error.where)
    assert axis in line


def test_what_the_scenario_says_itself_is_wrong_in_its_file(tmp_path: Path) -> None:
    project = Project(tmp_path / "project")
    with project.edited(SCENARIO) as scenario:
        scenario["environment"]["sun_elevation"] = "200 deg"
    error, line = refusal(project, sweep={"parameters": {"gap": ["30 m"]}})
    assert str(project.folder / SCENARIO) in str(error.where)
    assert "sun_elevation: 200 deg" in line
    assert "with the ODD's values" not in error.message
