"""What a report says about its points depends on how they were chosen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from adeye.report.build import ReportBuilder
from adeye.report.claims import GRID, SAMPLE, designs_of, is_sample, spoken_of
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from tests.project import Executed


def odd(*uses: tuple[str, str, str]) -> dict[str, Any]:
    return {
        "odd": {
            "scenarios": [
                {"use": use, "as": name or None, "sweep": {"design": design}}
                for use, name, design in uses
            ]
        }
    }


def test_design_is_found_by_the_id_in_the_odd() -> None:
    content = odd(("cut_in", "", "random"), ("cut_in", "late", "full_factorial"))
    assert designs_of(content) == {"cut_in": "random", "late": "full_factorial"}


@pytest.mark.parametrize("design", ["full_factorial", "zip", "list"])
def test_only_a_random_design_is_a_sample(design: str) -> None:
    assert is_sample("random")
    assert not is_sample(design)


def test_declared_distribution_is_spoken_of_as_such_and_not_as_uniform() -> None:
    content = odd(("cut_in", "", "random"), ("cut_out", "", "sobol"))
    law = {"gap": {"normal": {"mean": "30 m", "sd": "5 m"}}}
    for use in content["odd"]["scenarios"]:
        use["sweep"]["parameters"] = law
    designs = designs_of(content)
    assert (is_sample(designs["cut_in"]), is_sample(designs["cut_out"])) == (True, False)
    drawn, fixed = spoken_of(designs, designs)
    assert drawn.startswith("cut_in: points drawn from the declared distribution of each axis")
    assert "drawn uniformly" not in drawn
    assert fixed == GRID.format(scenarios="cut_out")


def test_each_kind_of_design_is_spoken_of_once() -> None:
    designs = {"a": "random", "b": "zip", "c": "random", "d": "full_factorial"}
    assert spoken_of(designs, designs) == (
        SAMPLE.format(scenarios="a, c"),
        GRID.format(scenarios="b, d"),
    )
    assert spoken_of(designs, ("b",)) == (GRID.format(scenarios="b"),)


@pytest.mark.slow
def test_report_calls_only_its_grid_no_random_sample(suites: Executed, mini: Executed) -> None:
    statements = []
    for executed in (suites, mini):
        with Repository.open(executed.db, create=False) as repository:
            campaign = repository.find_campaign(executed.summary.campaign)
            report = ReportBuilder(repository, campaign, "my.db").build(lambda _: (), replays=0)
        statements.append(report.statements)
    drawn, fixed = statements[0]
    assert drawn.startswith("cut_in: points drawn uniformly")
    assert "not a random sample" not in drawn
    assert fixed.startswith("lead_braking: a designed set of points, not a random sample")
    (only,) = statements[1]
    assert only.startswith("cut_in, lead_braking: a designed set of points, not a random sample")
