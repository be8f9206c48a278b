"""Take down an executed campaign: what the database says, pairs that find each other."""

from __future__ import annotations

from collections import Counter

import pytest

from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.gate.baseline import LETTERS, Baseline
from adeye.report.gate.snapshot import case_keys, take_down
from adeye.store.read.totals import totals
from adeye.store.repository import Repository
from tests.project import Executed


def taken(executed: Executed, *, named: bool = True) -> Baseline:
    with Repository.open(executed.db, create=False) as repository:
        campaign = repository.find_campaign(executed.summary.campaign)
        names = list(executed.plan.files.architectures) if named else []
        compared = repository.compared(campaign.id, names, is_named=True)
        found = totals(repository, campaign)
        return take_down(repository, campaign, found, compared, ExitCode.OK)


@pytest.fixture(scope="module")
def baseline(mini: Executed) -> Baseline:
    return taken(mini)


def test_totals_are_those_of_the_campaign(baseline: Baseline, mini: Executed) -> None:
    cells = {(cell.fsr, cell.architecture): cell for cell in baseline.cells if not cell.scenario}
    for line in mini.summary.verdicts:
        cell = cells[line.fsr, line.architecture]
        assert (cell.verdict, cell.exercised) == (line.verdict, line.exercised)
        assert sum(cell.counts.values()) == line.runs


def test_letters_add_up_to_the_counts(baseline: Baseline) -> None:
    assert baseline.cases is not None
    assert sum(len(part.rows) for part in baseline.cases) == baseline.planned == 28
    for part in baseline.cases:
        for place, fsr in enumerate(part.fsrs):
            letters = Counter(LETTERS[row.verdicts[place]] for row in part.rows)
            (cell,) = [
                cell for cell in baseline.cells
                if (cell.fsr, cell.architecture, cell.scenario)
                == (fsr, part.architecture, part.scenario)
            ]  # fmt: skip
            assert {word: count for word, count in letters.items() if word} == cell.counts


def test_architectures_meet_on_the_same_keys(baseline: Baseline) -> None:
    keys = {
        (part.scenario, part.architecture): [row.key for row in part.rows]
        for part in baseline.cases or ()
    }
    assert keys["cut_in", "legacy_camera"] == keys["cut_in", "camera_radar"]
    assert len({key for names in keys.values() for key in names}) == 14


def test_keys_differ_within_an_architecture(mini: Executed) -> None:
    with Repository.open(mini.db, create=False) as repository:
        compared = repository.compared(mini.summary.campaign, ["camera_radar"], is_named=True)
    assert len(set(case_keys(compared))) == len(compared) == 14


def test_margins_agree_with_the_worst_of_their_cell(baseline: Baseline) -> None:
    looked = 0
    for part in baseline.cases or ():
        for place, fsr in enumerate(part.fsrs):
            judged = [row for row in part.rows if row.verdicts[place] in "PF"]
            margins = [row.margins[place] for row in judged]
            (cell,) = [
                cell for cell in baseline.cells
                if (cell.fsr, cell.architecture, cell.scenario)
                == (fsr, part.architecture, part.scenario)
            ]  # fmt: skip
            if cell.margin and part.measures[place] and cell.verdict is not Verdict.VACUOUS:
                assert cell.margin.value == min(value for value in margins if value is not None)
                looked += 1
    assert looked > 5


def test_too_many_test_cases_are_left_out(mini: Executed, baseline: Baseline) -> None:
    without = taken(mini, named=False)
    assert without.cases is None
    assert without.cells == baseline.cells
