"""Where an FSR fails: what is said plans and chooses exactly these test cases."""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from adeye.campaign.plan import CampaignPlan
from adeye.campaign.selection import Keyword
from adeye.errors import UsageError
from adeye.judge.pairing import NOT_RUN
from adeye.judge.verdict import FAIL, INCONCLUSIVE, INVALID, PASS, VACUOUS
from adeye.report.where.records import Separation, Site
from adeye.report.where.tell import Cases, cases_of, tell_where
from adeye.store.write.queue import NamedCase
from adeye.sweep.case import TestCase
from tests.frozen import as_json, assert_frozen, masked
from tests.project import Executed, Project
from tests.report.where.planting import AXES, SAFE, compared_of
from tests.sql import rows


def planted(plan: CampaignPlan, verdict: Callable[[TestCase], int]) -> Site:
    """Judge a plan without executing it, and tell where what was planted fails."""
    (site,) = sites(plan, [verdict(case) for case in plan.cases])
    return site.told(("gap",))


def sites(plan: CampaignPlan, verdicts: list[int]) -> list[Cases]:
    return list(
        cases_of(compared_of(plan, {"FSR-1": verdicts}), "FSR-1", plan.record().odd.content)
    )


def point(case: TestCase) -> tuple[float, float, str]:
    return float(case.point["gap"]), float(case.point["ego_speed"]) * 3.6, case.fault_entry


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Project:
    return Project(tmp_path_factory.mktemp("where") / "project", SAFE)


@pytest.fixture
def project(folder: Project) -> Project:
    """The safe ODD, whatever a test before has made of it."""
    folder.write("odd/tested.yaml", SAFE)
    return folder


def narrowed(project: Project, found: Separation) -> CampaignPlan:
    """Plan the ODD with what was said, as it stands."""
    (use,) = SAFE["scenarios"]
    sweep = {**use["sweep"], "where": list(found.where)}
    chosen = {**use, "sweep": sweep, **({"faults": list(found.faults)} if found.faults else {})}
    project.write("odd/tested.yaml", {**SAFE, "scenarios": [chosen]})
    return project.plan()


REGIONS: dict[str, Callable[[TestCase], bool]] = {
    "interval": lambda case: 23.0 < point(case)[0] < 33.0,
    "corner": lambda case: point(case)[0] < 30.0 and point(case)[1] > 99.0,
    "fault": lambda case: point(case)[0] < 30.0 and point(case)[2] != "none",
    "range": lambda case: case.point[list(AXES)[2]] == 120.0 and point(case)[1] < 101.0,
    "around": lambda case: not 23.0 < point(case)[0] < 33.0,
}


@pytest.mark.parametrize("region", REGIONS)
def test_planning_with_what_is_said_gives_exactly_the_failures(
    project: Project, region: str
) -> None:
    plan = project.plan()
    fails = REGIONS[region]
    site = planted(plan, lambda case: FAIL if fails(case) else PASS)
    (found,) = site.separations
    wanted = {case.digest for case in plan.cases if fails(case)}
    assert found.inside.failed == len(wanted)
    assert found.inside.passed == found.outside.failed == 0
    # A plan always has the fault-free entry, which ``faults`` does not name.
    again = narrowed(project, found).cases
    chosen = [case for case in again if case.fault_entry in (found.faults or {case.fault_entry})]
    assert {case.digest for case in chosen} == wanted
    assert bool(found.faults) == (region == "fault")
    if region != "around":
        word = Keyword.parse(found.keyword)
        assert {case.digest for case in plan.cases if word.matches(named(case))} == wanted


def named(case: TestCase) -> NamedCase:
    return NamedCase(
        scenario=case.scenario_id,
        architecture=case.architecture.architecture,
        fault_entry=case.fault_entry,
        point=json.dumps(dict(case.point)),
        replicate=case.replicate,
    )


def test_what_no_box_holds_is_told_by_several_with_what_each_misses(project: Project) -> None:

    def fails(case: TestCase) -> bool:
        return point(case)[2] != "none" or point(case)[0] < 21.0

    site = planted(project.plan(), lambda case: FAIL if fails(case) else PASS)
    first, second = site.separations
    assert (first.faults, first.where, first.outside.failed) == (("front_camera_out",), (), 9)
    assert (second.where, second.inside.failed, second.outside.failed) == (("gap == 20 m",), 9, 0)


def test_failure_that_no_three_axes_hold_apart_has_no_condition(project: Project) -> None:
    plan = project.plan()
    site = planted(plan, lambda case: FAIL if case == plan.cases[0] else PASS)
    (found,) = site.separations
    assert (found.where, found.faults, found.keyword.count("=")) == ((), (), 2)
    assert (found.inside.failed, found.inside.passed) == (1, len(plan.cases) - 1)


def test_what_is_no_pass_is_never_counted_as_one(project: Project) -> None:
    others = {24.0: INCONCLUSIVE, 28.0: INVALID, 32.0: VACUOUS, 40.0: NOT_RUN}
    site = planted(project.plan(), lambda case: others.get(point(case)[0], FAIL))
    assert site.separations == ()
    assert site.tally.model_dump() == {"failed": 18, "passed": 0, "vacuous": 18, "undecided": 54}
    assert [level.tally.failed for level in site.table] == [18, 0, 0, 0, 0]


def test_of_equal_margins_the_run_of_the_least_digest_is_the_worst(project: Project) -> None:
    plan = project.plan()
    rest = plan.cases[1:]
    failing = [case for case in rest if case.fault_entry == rest[0].fault_entry]
    told = planted(plan, lambda case: FAIL if case in failing else PASS)
    assert told.run == min(case.digest for case in failing)


def test_axis_of_a_fault_is_told_of_the_test_cases_that_have_it(project: Project) -> None:
    (use,) = SAFE["scenarios"]
    onset = "faults.front_camera_out.onset.at"
    swept = {"parameters": {"gap": AXES["gap"], onset: ["1 s", "2 s", "3 s"]}}
    project.write("odd/tested.yaml", {**SAFE, "scenarios": [{**use, "sweep": swept}]})
    plan = project.plan()
    codes = [FAIL if float(case.point.get(onset, 9.0)) < 2.5 else PASS for case in plan.cases]
    plain, faulty = (site.told(()) for site in sites(plan, codes))
    assert (plain.faults, plain.tally.failed, plain.separations) == (("none",), 0, ())
    (found,) = faulty.separations
    assert found.faults == ("front_camera_out",)
    assert '"fault=front_camera_out"' in found.keyword
    assert (faulty.faults, found.where) == (("front_camera_out",), (f"{onset} <= 2 s",))
    assert (faulty.tally.failed, found.inside.passed) == (10, 0)


def test_axis_along_which_the_verdict_turns_twice_is_not_monotone(project: Project) -> None:
    plan = project.plan()
    for fails, trend, turning in (
        (lambda gap: gap == 28.0, "not monotone", 18),
        (lambda gap: gap >= 28.0, "upwards", 0),
        (lambda gap: gap <= 28.0, "downwards", 0),
        (lambda gap: gap < 0.0, "none", 0),
    ):
        site = planted(plan, lambda case, fails=fails: FAIL if fails(point(case)[0]) else PASS)  # type: ignore[misc]
        axes = {axis.name: axis for axis in site.axes}
        assert (axes["gap"].trend, axes["gap"].lines, axes["gap"].turning) == (trend, 18, turning)
        assert axes["ego_speed"].changing == 0
        assert (axes["gap"].lowest, axes["gap"].highest) == ("20 m", "40 m")


def test_counts_are_those_of_the_view(suites: Executed) -> None:
    with suites.opened() as (repository, campaign):
        found = tell_where(repository, campaign, "FSR-02", by=("deceleration",))
    sql = "SELECT scenario, architecture, verdict, count(*) FROM v_verdicts WHERE fsr = 'FSR-02'"
    counts = {tuple(row[:3]): row[3] for row in rows(suites.db, f"{sql} GROUP BY 1, 2, 3")}
    for site in found.sites:
        at = site.scenario, site.architecture
        assert site.tally.failed == counts.get((*at, "FAIL"), 0)
        assert site.tally.passed == counts.get((*at, "PASS"), 0)
        for axis in site.axes:
            assert sum(level.tally.failed for level in axis.levels) == site.tally.failed
        assert bool(site.table) == (site.scenario == "lead_braking")
    assert found.failed > 0


def test_what_is_not_there_is_refused(mini: Executed) -> None:
    with mini.opened() as (repository, campaign):
        for asked, said in (
            ({"fsr": "FSR-99"}, "no FSR 'FSR-99'"),
            ({"by": ("gup",)}, "Did you mean 'gap'"),
            ({"by": ("gap", "ego_speed", "fault")}, "--by has 3 axes"),
            ({"architectures": ("radar",)}, "no architecture 'radar'"),
        ):
            fsr = asked.pop("fsr", "FSR-02")
            with pytest.raises(UsageError, match=said):
                tell_where(repository, replace(campaign), fsr, **asked)  # type: ignore[arg-type]


def test_what_is_told_of_planted_failures_is_frozen(project: Project) -> None:
    """Where they are, with how many on which side, and the words that choose and plan them."""
    plan = project.plan()
    lines = []
    regions: dict[str, Callable[[TestCase], bool]] = {
        **REGIONS,
        "two": lambda case: point(case)[2] != "none" or point(case)[0] < 21.0,
        "few": lambda case: point(case)[0] < 21.0 and point(case)[1] > 119.0,
        "every fifth": lambda case: int(7 * point(case)[0] + 3 * point(case)[1]) % 5 == 0,
    }
    for name, fails in regions.items():
        for other in (PASS, VACUOUS, INCONCLUSIVE):

            def verdict(case: TestCase, fails: Any = fails, other: int = other) -> int:
                if point(case)[1] > 125.0 and other != PASS:
                    return other
                return FAIL if fails(case) else PASS

            site = planted(plan, verdict)
            (cases,) = sites(plan, [verdict(case) for case in plan.cases])
            lines.append(f"{name}, {other}, told by {', '.join(cases.mattering) or 'none'}")
            lines.append(as_json(site.model_dump(mode="json")))
    assert_frozen("where.txt", masked("\n".join(lines)))
