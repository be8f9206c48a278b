"""Take down an executed campaign: what the database says, pairs that find each other."""

from collections import Counter

import pytest

from adeye.identity import digest
from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.gate.baseline import LETTERS, Baseline, BaselineCases, BaselineCell
from adeye.report.gate.decide import case_keys, take_down
from adeye.store.read.totals import totals
from tests.project import Executed
from tests.stored import known


def taken(executed: Executed, *, named: bool = True) -> Baseline:
    with executed.opened() as (repository, campaign):
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


def test_domain_that_the_evidence_stands_for_is_part_of_it(
    baseline: Baseline, mini: Executed
) -> None:
    with mini.opened() as (repository, campaign):
        domain = repository.content("odd", campaign.odd_digest)["odd"]["attributes"]
    assert domain["environment"]
    assert baseline.attributes == digest(domain)


def cell_of(baseline: Baseline, part: BaselineCases, fsr: str) -> BaselineCell:
    place = (fsr, part.architecture, part.scenario)
    (found,) = (c for c in baseline.cells if (c.fsr, c.architecture, c.scenario) == place)
    return found


def test_letters_add_up_to_the_counts_and_margins_are_those_of_their_cell(
    baseline: Baseline,
) -> None:
    parts = known(baseline.cases)
    assert sum(len(part.rows) for part in parts) == baseline.planned == 28
    looked = 0
    for part in parts:
        for place, fsr in enumerate(part.fsrs):
            cell = cell_of(baseline, part, fsr)
            letters = Counter(LETTERS[row.verdicts[place]] for row in part.rows)
            assert {word: count for word, count in letters.items() if word} == cell.counts
            judged = [row.margins[place] for row in part.rows if row.verdicts[place] in "PF"]
            if cell.margin and part.measures[place] and cell.verdict is not Verdict.VACUOUS:
                assert cell.margin.value == min(value for value in judged if value is not None)
                looked += 1
    assert looked > 5


def test_architectures_meet_on_the_same_keys(baseline: Baseline) -> None:
    keys = {
        (part.scenario, part.architecture): [row.key for row in part.rows]
        for part in baseline.cases or ()
    }
    assert keys["cut_in", "legacy_camera"] == keys["cut_in", "camera_radar"]
    assert len({key for names in keys.values() for key in names}) == 14


def test_keys_differ_within_an_architecture(mini: Executed) -> None:
    with mini.opened() as (repository, campaign):
        compared = repository.compared(campaign.id, ["camera_radar"], is_named=True)
    assert len(set(case_keys(compared))) == len(compared) == 14


def test_too_many_test_cases_are_left_out(mini: Executed, baseline: Baseline) -> None:
    without = taken(mini, named=False)
    assert without.cases is None
    assert without.cells == baseline.cells
