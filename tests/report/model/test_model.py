from dataclasses import replace
from typing import Any

import pytest
from pydantic import ValidationError

from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.model.report import Architecture, Cell, Report
from adeye.store.read.totals import ChannelFailure
from tests.report.parts import claim, claims, line, step


def rebuilt(report: Report, **changes: Any) -> Report:
    """Build the report again with other fields, through its checks."""
    fields = {name: getattr(report, name) for name in Report.model_fields}
    return Report(**{**fields, **changes})


def without(report: Report, fsr: str, architecture: str) -> tuple[Cell, ...]:
    wanted = (fsr, architecture, None)
    return tuple(c for c in report.cells if (c.fsr, c.architecture, c.scenario) != wanted)


def not_applicable(fsr: str, architecture: str) -> Cell:
    return Cell(fsr=fsr, architecture=architecture, verdict=None, command="adeye show")


def test_architecture_passes_if_every_mandatory_fsr_does(report: Report) -> None:
    assert report.verdict_of("camera_radar") is Verdict.PASS
    assert report.verdict_of("legacy_camera") is Verdict.FAIL
    assert report.verdict_of("lidar") is Verdict.ERROR


def test_optional_fsr_decides_nothing(report: Report) -> None:
    fsrs = tuple(fsr for fsr in report.fsrs if fsr.id == "FSR-07")
    cells = tuple(cell for cell in report.cells if cell.fsr == "FSR-07")
    parts = {"fsrs": fsrs, "cells": cells, "worst_cases": (), "confidence": None}
    small = rebuilt(report, **parts, exit_code=ExitCode.INCOMPLETE)
    # No mandatory FSR at all is no evidence.
    assert small.verdict_of("legacy_camera") is Verdict.NOT_RUN


def test_missing_cell_is_not_run(report: Report) -> None:
    cells = without(report, "FSR-01", "camera_radar")
    small = rebuilt(report, cells=cells, exit_code=ExitCode.INCOMPLETE)
    assert small.verdict_of("camera_radar") is Verdict.NOT_RUN


def test_fsr_that_is_not_applicable_is_an_error_in_the_gate(report: Report) -> None:
    cells = (
        *without(report, "FSR-01", "camera_radar"),
        not_applicable("FSR-01", "camera_radar"),
    )
    changed = rebuilt(report, cells=cells, exit_code=ExitCode.INCOMPLETE)
    assert changed.verdict_of("camera_radar") is Verdict.ERROR


def test_fsr_that_is_not_applicable_is_no_evidence_outside_the_gate(report: Report) -> None:
    compared = tuple(item.model_copy(update={"is_gate": False}) for item in report.architectures)
    cells = (
        *without(report, "FSR-01", "camera_radar"),
        not_applicable("FSR-01", "camera_radar"),
    )
    code = ExitCode.INCOMPLETE
    changed = rebuilt(report, cells=cells, architectures=compared, exit_code=code)
    assert changed.verdict_of("camera_radar") is Verdict.NOT_RUN


def test_green_exit_code_beside_a_red_gate_is_refused(report: Report) -> None:
    gate = tuple(item.model_copy(update={"is_gate": True}) for item in report.architectures)
    with pytest.raises(ValidationError, match="exit code 0, but the gate is"):
        rebuilt(report, architectures=gate)


def test_green_exit_code_beside_a_refused_failure_of_a_channel_is_refused(report: Report) -> None:
    failure = ChannelFailure("camera_radar", "nominal", "channel_error", 2, 1, "KeyError", 0, "")
    with pytest.raises(ValidationError, match="exit code 0, but channel_error of channel nominal"):
        rebuilt(report, channel_failures=(failure,))


def test_green_exit_code_without_a_gate_is_refused(report: Report) -> None:
    compared = tuple(item.model_copy(update={"is_gate": False}) for item in report.architectures)
    with pytest.raises(ValidationError, match=r"exit code 0, but the gate is \{\}"):
        rebuilt(report, architectures=compared)


@pytest.mark.parametrize(("planned", "accounted"), [(540, 539), (539, 540), (0, 0)])
def test_green_exit_code_with_unaccounted_cases_is_refused(
    report: Report, planned: int, accounted: int
) -> None:
    with pytest.raises(ValidationError, match="accounted for"):
        rebuilt(report, planned=planned, accounted=accounted)


def test_red_exit_code_beside_a_green_gate_is_allowed(report: Report) -> None:
    assert rebuilt(report, exit_code=ExitCode.INTEGRITY).exit_code is ExitCode.INTEGRITY


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"runs": 3}, "3 runs, but counts"),
        ({"exercised": 3}, "3 exercised"),
        ({"verdict": Verdict.PASS}, "over a failed run"),
        ({"verdict": None}, "over a failed run"),
    ],
)
def test_cell_that_contradicts_itself_is_refused(changes: dict[str, Any], message: str) -> None:
    fields: dict[str, Any] = {
        "fsr": "FSR-01",
        "architecture": "a",
        "verdict": Verdict.FAIL,
        "counts": {Verdict.FAIL: 1, Verdict.PASS: 1},
        "runs": 2,
        "exercised": 2,
        "command": "adeye show",
    }
    Cell(**fields)
    with pytest.raises(ValidationError, match=message):
        Cell(**{**fields, **changes})


def test_pass_without_a_passing_run_is_refused() -> None:
    with pytest.raises(ValidationError, match="PASS without a run that passed"):
        Cell(
            fsr="FSR-01",
            architecture="a",
            verdict=Verdict.PASS,
            counts={Verdict.VACUOUS: 2},
            runs=2,
            command="adeye show",
        )


@pytest.mark.parametrize(
    ("field", "message"),
    [
        ("fsrs", "is not an FSR"),
        ("architectures", "is not an architecture"),
        ("scenarios", "is not a scenario"),
    ],
)
def test_number_that_belongs_to_nothing_is_refused(
    report: Report, field: str, message: str
) -> None:
    with pytest.raises(ValidationError, match=message):
        rebuilt(report, **{field: getattr(report, field)[1:], "exit_code": ExitCode.FAILED})


@pytest.mark.parametrize("field", ["fsrs", "architectures", "scenarios", "cells", "replays"])
def test_same_thing_twice_is_refused(report: Report, field: str) -> None:
    items = getattr(report, field)
    with pytest.raises(ValidationError, match="is there twice"):
        rebuilt(report, **{field: (*items, items[0])})


def test_cell_is_found_by_its_place(report: Report) -> None:
    found = report.cell("FSR-02", "lidar", "cut_in")
    assert found is not None
    assert found.verdict is Verdict.INVALID
    assert report.cell("FSR-02", "lidar", "nowhere") is None


def test_copy_with_other_cells_finds_its_own(report: Report) -> None:
    assert report.cell("FSR-02", "lidar") is not None
    copy = report.model_copy(update={"cells": report.cells[:1]})
    assert copy.cell("FSR-02", "lidar") is None
    assert copy.cell(*(report.cells[0].fsr, report.cells[0].architecture)) == report.cells[0]
    assert report.cell("FSR-02", "lidar") is not None


@pytest.mark.parametrize("cost", [float("nan"), float("inf")])
def test_number_that_is_not_finite_is_refused(cost: float) -> None:
    with pytest.raises(ValidationError, match="finite"):
        Architecture(id="a", title="a", is_gate=True, cost=cost)


def test_report_cannot_be_changed(report: Report) -> None:
    with pytest.raises(ValidationError, match="frozen"):
        report.exit_code = ExitCode.FAILED  # type: ignore[misc]


def test_suite_of_an_unknown_architecture_or_twice_is_refused(report: Report) -> None:
    (suite,) = report.suites
    with pytest.raises(ValidationError, match="suites: 'camera_radar' is there twice"):
        rebuilt(report, suites=(suite, suite))
    with pytest.raises(ValidationError, match="'other' is not an architecture of the report"):
        rebuilt(report, suites=(replace(suite, architecture="other"),))


@pytest.mark.parametrize(
    ("part", "changes", "message"),
    [
        ("confidence", {"fsr": "FSR-99"}, "'FSR-99' is not an FSR"),
        ("confidence", {"architecture": "sonar"}, "'sonar' is not an architecture"),
        ("confidence", {"scenario": "drift"}, "'drift' is not a scenario"),
        ("step_uncertainty", {"architecture": "sonar"}, "'sonar' is not an architecture"),
        ("step_uncertainty", {"scenario": "drift"}, "'drift' is not a scenario"),
    ],
)
def test_statement_about_what_is_not_there_is_refused(
    report: Report, part: str, changes: dict[str, str], message: str
) -> None:
    told = claims(claim(**changes)) if part == "confidence" else step(lines=(line(**changes),))
    with pytest.raises(ValidationError, match=message):
        rebuilt(report, **{part: told})
