"""The traceability matrix: every way through the chain, and where it ends too soon."""

import csv
from typing import Any

from adeye.judge.verdict import Verdict
from adeye.report.formats.matrix import BY, COLUMNS, grouped, matrix_of, render_csv
from adeye.report.formats.sarif import judged_in
from adeye.report.model.report import Report


def gaps(report: Report) -> set[str]:
    return {row.gap for row in matrix_of(report) if row.gap and not row.verdict}


def test_rows_are_the_ways_through_the_chain(report: Report) -> None:
    rows = [row for row in matrix_of(report) if row.verdict]
    expected = sum(
        len(fsr.allocation) * len(list(judged_in(report, fsr))) * len(report.architectures)
        for hazard in report.hazards
        for goal in report.goals
        if hazard.id in goal.hazards
        for fsr in report.fsrs
        if goal.id in fsr.goals
    )
    assert len(rows) == len(set(rows)) == expected > 0


def test_row_reaches_from_hazard_to_run(report: Report) -> None:
    row = next(
        item
        for item in matrix_of(report)
        if (item.fsr, item.scenario, item.architecture) == ("FSR-02", "cut_in", "legacy_camera")
    )
    assert (row.hazard, row.goal, row.hazard_asil) == ("HE-01", "SG-01", "D")
    assert (row.verdict, row.gap) == ("FAIL", "fail")
    assert row.margin is not None
    assert row.margin < 0.0
    assert row.worst_run


def test_every_order_has_the_same_rows_and_keeps_groups_together(report: Report) -> None:
    for by in BY:
        rows = matrix_of(report, by)
        assert set(rows) == set(matrix_of(report))
        names = [getattr(row, by) for row in rows]
        runs = [name for at, name in enumerate(names) if at == 0 or names[at - 1] != name]
        assert len(runs) == len(set(runs))
        assert [group.id for group in grouped(rows, by)] == runs


def test_way_back_from_a_scenario_finds_the_hazards(report: Report) -> None:
    group = next(
        item for item in grouped(matrix_of(report, "scenario"), "scenario") if item.id == "cut_in"
    )
    assert group.links["hazard"] == ("HE-01", "HE-02")
    assert set(group.links["fsr"]) == {fsr.id for fsr in report.fsrs}
    # Each verdict is counted once, however many elements the FSR is allocated to.
    assert sum(group.verdicts.values()) == len(report.fsrs) * len(report.architectures)


def test_chain_that_ends_too_soon_stands_out(report: Report) -> None:
    def changed(**parts: Any) -> Report:
        return report.model_copy(update=parts)

    lonely = report.hazards[0].model_copy(update={"id": "HE-09"})
    assert "no safety goal" in gaps(changed(hazards=(lonely,)))
    # A hazard without an ASIL needs none.
    quiet = changed(hazards=(*report.hazards, lonely.model_copy(update={"asil": "QM"})))
    assert "no safety goal" not in gaps(quiet)
    assert "HE-09" in {row.hazard for row in matrix_of(quiet)}
    goal = report.goals[0].model_copy(update={"id": "SG-09"})
    assert "no FSR" in gaps(changed(goals=(*report.goals, goal)))
    assert "no FSR is allocated to it" in gaps(report)
    fsrs = tuple(item.model_copy(update={"scenarios": ("cut_in",)}) for item in report.fsrs)
    assert "no FSR is judged in it" in gaps(changed(fsrs=fsrs))
    row = next(row for row in matrix_of(changed(cells=())) if row.fsr)
    assert (row.verdict, row.gap) == ("NOT_RUN", "not run")


def test_csv_begins_with_its_column_and_reads_back(report: Report) -> None:
    rows = matrix_of(report, "scenario")
    read = list(csv.DictReader(render_csv(rows, "scenario").splitlines()))
    assert next(iter(read[0])) == "scenario"
    assert set(read[0]) == set(COLUMNS)
    assert [item["fsr"] for item in read] == [row.fsr for row in rows]


def test_csv_is_no_formula_for_a_spreadsheet(report: Report) -> None:
    first, *others = report.fsrs
    changed = first.model_copy(update={"formula": "=1+1"})
    rows = matrix_of(report.model_copy(update={"fsrs": (changed, *others)}))
    assert "=1+1" in {row.measure for row in rows}
    read = csv.DictReader(render_csv(rows, "hazard").splitlines())
    assert {item["measure"][:1] for item in read}.isdisjoint("=+-@")


def test_row_says_what_an_fsr_lacks_over_all_scenarios_and_what_is_waived(report: Report) -> None:
    def rows(**whole: Any) -> set[str]:
        cells = tuple(
            cell.model_copy(update={"verdict": Verdict.PASS, **({} if cell.scenario else whole)})
            for cell in report.cells
        )
        found = matrix_of(report.model_copy(update={"cells": cells}))
        return {row.gap for row in found if row.verdict == "PASS"}

    assert "" in rows()
    found = rows(verdict=Verdict.VACUOUS, min_exercised=99)
    assert all("vacuous over all scenarios" in gap and "of 99 needed" in gap for gap in found)
    waived = report.cells[0].model_copy(
        update={"verdict": Verdict.PASS, "counts": {Verdict.PASS: 1, Verdict.NOT_RUN: 1}}
    )
    assert waived.waived == (Verdict.NOT_RUN,)
