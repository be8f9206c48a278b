"""R19: the link table decides which sensor feeds which channel, and can be swept."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from adeye.campaign.replay import describe_run, replay_run
from adeye.errors import SweepError
from adeye.spec.sensors import Radar
from adeye.sweep.case import structure_key
from tests.project import CANDIDATE, MINI, Project, run_cases

if TYPE_CHECKING:
    from adeye.sweep.case import TestCase
    from tests.conftest import MakeProject

pytestmark = pytest.mark.requirements


def project_with(make_project: MakeProject, *variants: tuple[str, list[str]]) -> Project:
    """One cut-in; one architecture per link table of the nominal channel."""
    names = [f"architectures/{name}.yaml" for name, _ in variants]
    project = make_project(
        {
            **MINI,
            "scenarios": [
                {
                    "use": "cut_in",
                    "faults": ["none"],
                    "sweep": {"parameters": {"lateral_speed": ["2 m/s"], "gap": ["20 m"]}},
                }
            ],
            "faults": [],
            "architectures": names,
            "gate": {"architectures": [variants[0][0]]},
        }
    )
    base = project.read(CANDIDATE)
    for name, links in variants:
        base["architecture"] = name
        base["channels"]["nominal"]["links"] = links
        project.write(f"odd/architectures/{name}.yaml", base)
    return project


@pytest.mark.slow
def test_channel_is_fed_by_what_is_linked_to_it(make_project: MakeProject) -> None:
    project = project_with(
        make_project,
        ("both", ["localisation", "front_camera", "front_radar"]),
        ("camera_only", ["localisation", "front_camera"]),
        ("blind", ["localisation"]),
    )
    plan = project.plan()
    tracked = {}
    for case in plan.cases:
        trace = run_cases(plan, [case])
        nominal = trace.layout.channels.index("nominal")
        rows = int(trace.length[0]) - 1
        known = np.isfinite(trace["tracks"][0, :rows, nominal]).any()
        # The sensors are there and see, whoever listens to them.
        radar = trace.layout.sensors.index("front_radar")
        assert trace["detected"][0, :rows, radar].any()
        tracked[case.architecture.architecture] = (bool(known), trace.digests()[0])
    assert {name: known for name, (known, _) in tracked.items()} == {
        "both": True,
        "camera_only": True,
        "blind": False,
    }
    # One situation, three link tables, three drives.
    assert len({case.situation_digest for case in plan.cases}) == 1
    assert len({digest for _, digest in tracked.values()}) == 3


@pytest.mark.slow
def test_link_tables_are_compared_as_an_axis_of_one_campaign(make_project: MakeProject) -> None:
    project = project_with(
        make_project,
        ("both", ["localisation", "front_camera", "front_radar"]),
        ("camera_only", ["localisation", "front_camera"]),
    )
    summary = project.run()
    assert (summary.planned, summary.executed) == (2, 2)
    rows = {row["architecture"]: row for row in project.rows()}
    assert rows["both"]["situation"] == rows["camera_only"]["situation"]
    assert rows["both"]["trace_digest"] != rows["camera_only"]["trace_digest"]


LINKS = "architecture.channels.nominal.links"
LISTS = [
    ["localisation", "front_camera", "front_radar"],
    ["localisation", "front_camera"],
    ["localisation", "front_radar"],
    ["localisation"],
]


def swept_links(make_project: MakeProject, lists: list[list[str]]) -> Project:
    """One cut-in of one architecture; the list of links of its nominal channel is an axis."""
    return make_project(
        {
            **MINI,
            "scenarios": [
                {
                    "use": "cut_in",
                    "faults": ["none"],
                    "sweep": {"parameters": {"gap": ["15 m", "20 m"], LINKS: lists}},
                }
            ],
            "faults": [],
            "architectures": ["architectures/camera_radar.yaml"],
        }
    )


@pytest.mark.slow
def test_whole_lists_of_links_are_an_axis_of_a_sweep(make_project: MakeProject) -> None:
    project = swept_links(make_project, LISTS)
    plan = project.plan()
    cases = list(plan.cases)
    assert len(cases) == len(LISTS) * 2
    assert {case.architecture.channels["nominal"].links for case in cases} == {
        tuple(links) for links in LISTS
    }
    assert len({case.digest for case in cases}) == len(cases)
    # One situation per gap, whoever listens to what; one batch never mixes two lists.
    assert len({case.situation_digest for case in cases}) == 2
    assert len({structure_key(case) for case in cases}) == len(LISTS)
    summary = project.run()
    assert (summary.planned, summary.executed) == (len(cases), len(cases))
    rows = project.rows()
    assert {row["point"][LINKS] for row in rows} == {f"[{', '.join(links)}]" for links in LISTS}
    assert len({row["trace_digest"] for row in rows}) == len(rows)
    # Each run says which list it had, and comes out again.
    last = rows[-1]
    described = describe_run(project.db, last["run"])
    assert described["swept_paths"] == {LINKS: last["point"][LINKS]}
    assert replay_run(project.db, last["run"]).identical


def test_list_with_an_unknown_link_is_refused_at_its_axis(make_project: MakeProject) -> None:
    project = swept_links(make_project, [["localisation"], ["localisation", "sonar"]])
    with pytest.raises(SweepError, match=r"tested\.yaml:\d+:\d+: .*'sonar', which is none of"):
        project.plan()


def test_parameters_of_a_linked_sensor_are_swept(make_project: MakeProject) -> None:
    project = make_project()
    axis = "architecture.sensors.front_radar.mount.yaw"
    with project.edited_odd() as odd:
        odd["scenarios"] = [
            {
                "use": "cut_in",
                "faults": ["none"],
                "sweep": {"parameters": {axis: ["0 deg", "5 deg"]}},
            }
        ]
    radars = [
        case.architecture.sensors["front_radar"]
        for case in project.plan().cases
        if _is_candidate(case)
    ]
    yaws = {round(radar.mount.yaw, 3) for radar in radars if isinstance(radar, Radar)}
    assert yaws == {0.0, 0.087}


def _is_candidate(case: TestCase) -> bool:
    return case.architecture.architecture == "camera_radar"
