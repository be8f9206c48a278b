"""R19: the link table decides which sensor feeds which channel, and can be swept."""

import numpy as np
import pytest

from adeye.answers import describe_run
from adeye.campaign.replay import replay_run
from adeye.errors import SweepError
from adeye.spec.sensors import Radar
from adeye.sweep.case import structure_key
from tests.conftest import MakeProject
from tests.project import CANDIDATE, Project, odd_of, run_cases, use
from tests.refusals import refused

pytestmark = pytest.mark.requirements


ALL = ["localisation", "front_camera", "front_radar"]
LISTS = [ALL, ["localisation", "front_camera"], ["localisation", "front_radar"], ["localisation"]]


def project_with(make_project: MakeProject, **variants: list[str]) -> Project:
    """One cut-in; one architecture per link table of the nominal channel."""
    near = use("cut_in", {"lateral_speed": ["2 m/s"], "gap": ["20 m"]})
    project = make_project(odd_of(near, architectures=list(variants)))
    base = project.read(CANDIDATE)
    for name, links in variants.items():
        base["architecture"] = name
        base["channels"]["nominal"]["links"] = links
        project.write(f"odd/architectures/{name}.yaml", base)
    return project


@pytest.mark.slow
def test_channel_is_fed_by_what_is_linked_to_it(make_project: MakeProject) -> None:
    project = project_with(make_project, both=ALL, camera_only=LISTS[1], blind=LISTS[3])
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
    seeing = {name: known for name, (known, _) in tracked.items()}
    assert seeing == {"both": True, "camera_only": True, "blind": False}
    # One situation, three link tables, three drives.
    assert len({case.situation_digest for case in plan.cases}) == 1
    assert len({digest for _, digest in tracked.values()}) == 3


@pytest.mark.slow
def test_link_tables_are_compared_as_an_axis_of_one_campaign(make_project: MakeProject) -> None:
    project = project_with(make_project, both=ALL, camera_only=LISTS[1])
    summary = project.run()
    assert (summary.planned, summary.executed) == (2, 2)
    rows = {row["architecture"]: row for row in project.rows()}
    assert rows["both"]["situation"] == rows["camera_only"]["situation"]
    assert rows["both"]["trace_digest"] != rows["camera_only"]["trace_digest"]


LINKS = "architecture.channels.nominal.links"


def swept_links(make_project: MakeProject, lists: list[list[str]]) -> Project:
    """One cut-in of one architecture; the list of links of its nominal channel is an axis."""
    return make_project(odd_of(use("cut_in", {"gap": ["15 m", "20 m"], LINKS: lists})))


@pytest.mark.slow
def test_whole_lists_of_links_are_an_axis_of_a_sweep(make_project: MakeProject) -> None:
    project = swept_links(make_project, LISTS)
    plan = project.plan()
    cases = list(plan.cases)
    assert len(cases) == len(LISTS) * 2
    swept = {case.architecture.channels["nominal"].links for case in cases}
    assert swept == {tuple(links) for links in LISTS}
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
    refused(SweepError, project.plan, says=r"tested\.yaml:\d+:\d+: .*'sonar', which is none of")


def test_parameters_of_a_linked_sensor_are_swept(make_project: MakeProject) -> None:
    axis = "architecture.sensors.front_radar.mount.yaw"
    project = make_project(odd_of(use("cut_in", {axis: ["0 deg", "5 deg"]})))
    radars = [case.architecture.sensors["front_radar"] for case in project.plan().cases]
    yaws = {round(radar.mount.yaw, 3) for radar in radars if isinstance(radar, Radar)}
    assert yaws == {0.0, 0.087}
