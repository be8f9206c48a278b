"""A planted loss of field of view is found sooner on the same situations than on different ones."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy import stats

from adeye.judge.evaluate import FAIL
from adeye.judge.statistics import mcnemar_p
from adeye.kernel.random import owner_id, uniform
from adeye.report.comparison.candidates import Matching
from adeye.report.comparison.compare import compare
from adeye.report.comparison.records import CompareOptions
from adeye.store.repository import Repository
from tests.project import LEGACY, Project

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from adeye.signals import Bools, Ints

POINTS = 600
ODD: dict[str, Any] = {
    "odd": "narrower",
    "scenarios": [
        {
            "use": "cut_in",
            "faults": ["none"],
            "sweep": {
                "design": "random",
                "samples": POINTS,
                "parameters": {
                    "ego_speed": ["80 km/h", "130 km/h"],
                    "relative_speed": ["-50 km/h", "-10 km/h"],
                    "gap": ["5 m", "40 m"],
                    "lateral_speed": ["0.8 m/s", "2.8 m/s"],
                },
            },
        }
    ],
    "architectures": ["architectures/wide.yaml", "architectures/narrow.yaml"],
    "concept": "concepts/motorway_chauffeur.yaml",
    "step": "0.05 s",
    "seed": 7,
}


def shuffled(name: str, number: int) -> Ints:
    """Return the points in an order of its own, the same for everybody."""
    owner = np.uint64(owner_id(name))
    draws = [uniform(np.uint64(7), owner, number, place) for place in range(POINTS)]
    return np.argsort(draws).astype(np.int64)


def runs_needed(find: Callable[[int, int], float]) -> int:
    """Give the fewest points at which four of five subsamples find the loss at 5 %."""
    for points in range(20, POINTS + 1, 20):
        found = [find(points, number) < 0.05 for number in range(40)]
        if np.mean(found) >= 0.8:
            return points
    return POINTS


@pytest.mark.slow
def test_loss_of_twenty_degrees_needs_less_than_half_the_runs_in_pairs(tmp_path: Path) -> None:
    project = Project(tmp_path / "project", ODD)
    content = project.read(LEGACY)
    for name, angle in (("wide", "38 deg"), ("narrow", "18 deg")):
        changed = {**deepcopy(content), "architecture": name}
        changed["sensors"]["front_camera"]["field_of_view"] = angle
        project.write(f"odd/architectures/{name}.yaml", changed)
    summary = project.run()
    with Repository.open(project.db, create=False) as repository:
        campaign = repository.find_campaign(summary.campaign)
        cases = repository.compared(campaign.id, ("wide", "narrow"))
        found = compare(repository, campaign, CompareOptions(baseline="wide"))
    (contact,) = [item for item in found.differences if item.fsr == "FSR-01"]
    assert contact.inference is not None
    assert contact.inference.p_adjusted < 0.001
    assert contact.inference.interval.low > 0.0

    rows = Matching(cases).pairs("wide", "narrow")
    column = cases.fsrs.index("FSR-01")
    wide, narrow = (cases.verdict[item, column] == FAIL for item in rows)
    paired = runs_needed(lambda points, number: p_of_pairs(wide, narrow, points, number))
    apart = runs_needed(lambda points, number: p_of_groups(wide, narrow, points, number))
    assert 2 * paired < apart


def p_of_pairs(wide: Bools, narrow: Bools, points: int, number: int) -> float:
    chosen = shuffled("paired", number)[:points]
    a, b = wide[chosen], narrow[chosen]
    return mcnemar_p(int((a & ~b).sum()), int((b & ~a).sum()))


def p_of_groups(wide: Bools, narrow: Bools, points: int, number: int) -> float:
    a = wide[shuffled("wide", number)[:points]].sum()
    b = narrow[shuffled("narrow", number)[:points]].sum()
    return float(stats.fisher_exact([[a, points - a], [b, points - b]]).pvalue)
