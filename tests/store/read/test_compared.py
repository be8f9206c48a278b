"""The bulk read of a comparison: the same as the views show, also for what was not run."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.judge.evaluate import VERDICTS
from adeye.judge.pairing import NOT_JUDGED, NOT_RUN
from adeye.store.read.query import run_query
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from tests.project import Executed

BOTH = ("camera_radar", "legacy_camera")
WORDS = (*map(str, VERDICTS), "NOT_RUN", None)


def test_verdicts_are_those_of_the_view(mini: Executed) -> None:
    campaign = mini.summary.campaign
    with Repository.open(mini.db, create=False) as repository:
        compared = repository.compared(campaign, BOTH)
    found = run_query(
        mini.db,
        "SELECT ordinal, fsr, verdict, robustness_low, margin, unit FROM v_verdicts "
        "WHERE campaign = (SELECT id FROM campaign)",
    )
    assert len(compared) == len({row[0] for row in found.rows}) == mini.summary.planned
    assert len(found.rows) == int((compared.verdict != NOT_JUDGED).sum())
    for ordinal, fsr, verdict, robustness, margin, unit in found.rows:
        column = compared.fsrs.index(fsr)
        assert WORDS[compared.verdict[ordinal, column]] == verdict
        for value, stored in (
            (compared.robustness[ordinal, column], robustness),
            (compared.margin[ordinal, column], margin),
        ):
            assert np.isnan(value) if stored is None else value == stored
        code = compared.measured[ordinal, column]
        assert (None if code < 0 else compared.units[code]) == unit


def test_columns_are_those_of_the_runs(mini: Executed) -> None:
    campaign = mini.summary.campaign
    with Repository.open(mini.db, create=False) as repository:
        compared = repository.compared(campaign, BOTH)
        table = repository.results(campaign)
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    same: dict[str, set[int]] = {}
    points: dict[str, set[int]] = {}
    for place, row in enumerate(rows):
        assert compared.result[place] == row["run"]
        assert compared.architecture[place] == row["architecture"]
        assert compared.fault_entry[place] == row["fault_entry"]
        same.setdefault(row["situation"], set()).add(int(compared.situation[place]))
        key = row["scenario"] + json.dumps(row["parameters"])
        points.setdefault(key, set()).add(int(compared.point[place]))
    for groups in (same, points):
        assert all(len(codes) == 1 for codes in groups.values())
        assert len(set.union(*groups.values())) == len(groups)
    assert compared.is_done.all()
    assert compared.axes == {}


def test_channels_that_acted_are_those_of_the_timeline(mini: Executed) -> None:
    campaign = mini.summary.campaign
    with Repository.open(mini.db, create=False) as repository:
        compared = repository.compared(campaign, BOTH)
    found = run_query(
        mini.db,
        "SELECT DISTINCT ordinal, subject FROM v_timeline "
        "WHERE kind = 'switch' AND campaign = (SELECT id FROM campaign)",
    )
    acted = {
        (place, name)
        for place in range(len(compared))
        for bit, name in enumerate(compared.channels)
        if compared.acting[place] >> bit & 1
    }
    assert acted == set(found.rows)
    assert {name for _, name in acted} == {"nominal", "safety"}


def test_only_the_named_architectures_are_read(mini: Executed) -> None:
    with Repository.open(mini.db, create=False) as repository:
        one = repository.compared(mini.summary.campaign, ("camera_radar",))
        none = repository.compared(mini.summary.campaign, ("unheard_of",))
    assert one.architecture.words == ("camera_radar",)
    assert len(one) == mini.summary.planned / 2
    assert len(none) == 0


def test_planned_case_without_a_result_is_not_run(repository: Repository, example: Any) -> None:
    plan = repository.plan_campaign(example.record(), example.cases(8), block_size=4)
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    assert repository.complete_block(block, example.runs(block))
    compared = repository.compared(plan.campaign, ("legacy", "new"))
    assert compared.is_done.tolist() == [True] * 4 + [False] * 4
    judged = compared.verdict[:, compared.fsrs.index("FSR1")]
    assert (judged[:4] < NOT_RUN).all()
    assert (judged[4:] == NOT_RUN).all()
    # FSR3 is asked for outside the ODD only.
    assert (compared.verdict[:, compared.fsrs.index("FSR3")] == NOT_JUDGED).all()
    assert np.isnan(compared.margin[4:]).all()
    assert not compared.has_object.any()


def test_fsr_that_is_not_applicable_has_no_verdict(repository: Repository, example: Any) -> None:
    example.not_applicable = {"FSR1": {"new": "no such signal"}}
    compared = repository.compared(example.campaign(repository), ("legacy", "new"))
    is_new = compared.architecture.codes == compared.architecture.words.index("new")
    judged = compared.verdict[:, compared.fsrs.index("FSR1")]
    assert (judged[is_new] == NOT_JUDGED).all()
    assert (judged[~is_new] == 0).all()
