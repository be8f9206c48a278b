"""Coverage of a plan and of its campaign: equal once everything is executed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from adeye.campaign.integrity import executed_coverage, planned_coverage
from adeye.errors import SpecError

if TYPE_CHECKING:
    from tests.conftest import MakeProject
    from tests.project import Executed


def test_executed_campaign_covers_what_was_planned(mini: Executed) -> None:
    planned = planned_coverage(mini.project.odd, 2)
    executed = executed_coverage(mini.db, None, 2)
    assert (planned.planned, planned.counted) == (28, 28)
    assert executed.planned == 28
    assert executed.counted == 28 - executed.not_judged
    if not executed.not_judged:
        assert executed.coverage == planned.coverage


@pytest.mark.slow
def test_declared_bins_change_the_coverage_and_no_test_case(make_project: MakeProject) -> None:
    project = make_project()
    before = [case.digest for case in project.plan().cases]
    with project.edited_odd() as odd:
        odd["coverage"] = {"ego_speed": ["60 km/h", "100 km/h", "130 km/h"]}
    found = planned_coverage(project.odd, 1)
    (speed,) = [i for i in found.coverage.combinations if i.attributes == ("ego_speed",)]
    assert (speed.feasible, speed.covered) == (2, 2)
    assert [case.digest for case in project.plan().cases] == before


def test_odd_without_bins_stores_nothing_about_them(make_project: MakeProject) -> None:
    content = make_project().plan().files.odd.spec.model_dump(mode="json")
    assert "coverage" not in content
    assert "strength" not in content["scenarios"][0]["sweep"]


def test_cases_outside_the_odd_count_nowhere(make_project: MakeProject) -> None:
    project = make_project()
    with project.edited_odd() as odd:
        odd["attributes"] = {"dynamic_elements": {"ego_speed": {"max": "90 km/h"}}}
        odd["outside"] = "robustness"
    found = planned_coverage(project.odd, 1)
    assert found.counted + found.outside_odd == found.planned == 28
    # Cut-ins at 120 km/h: two gaps, three fault entries, two architectures.
    assert found.outside_odd == 2 * 3 * 2


def test_bins_beyond_the_odd_are_refused_with_their_line(make_project: MakeProject) -> None:
    project = make_project()
    with project.edited_odd() as odd:
        odd["attributes"] = {"dynamic_elements": {"ego_speed": {"max": "130 km/h"}}}
        odd["coverage"] = {"ego_speed": ["140 km/h", "160 km/h"]}
    with pytest.raises(SpecError, match="ego_speed: no bin lies within") as caught:
        planned_coverage(project.odd, 1)
    assert caught.value.where is not None
    assert caught.value.where.path.endswith("tested.yaml")
