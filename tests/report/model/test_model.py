"""A report holds together: its verdicts, its exit code, its cells, and what they belong to."""

from dataclasses import replace
from typing import Any

import pytest
from pydantic import ValidationError

from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.model.report import Cell, Report
from adeye.store.read.totals import ChannelFailure
from tests.refusals import refused
from tests.report.parts import claim, claims, line, step
from tests.stored import known


def rebuilt(report: Report, **changes: Any) -> Report:
    """Build the report again with other fields, through its checks."""
    fields = {name: getattr(report, name) for name in Report.model_fields}
    return Report(**{**fields, **changes})


def without(report: Report, fsr: str, architecture: str) -> tuple[Cell, ...]:
    wanted = (fsr, architecture, None)
    return tuple(c for c in report.cells if (c.fsr, c.architecture, c.scenario) != wanted)


def test_architecture_passes_if_every_mandatory_fsr_does(report: Report) -> None:
    assert report.verdict_of("camera_radar") is Verdict.PASS
    assert report.verdict_of("legacy_camera") is Verdict.FAIL
    assert report.verdict_of("lidar") is Verdict.ERROR


def test_optional_fsr_decides_nothing(report: Report) -> None:
    fsrs = tuple(fsr for fsr in report.fsrs if fsr.id == "FSR-07")
    cells = tuple(cell for cell in report.cells if cell.fsr == "FSR-07")
    parts = {"fsrs": fsrs, "cells": cells, "worst_cases": (), "confidence": None}
    parts["failing"] = None
    small = rebuilt(report, **parts, exit_code=ExitCode.INCOMPLETE)
    # No mandatory FSR at all is no evidence.
    assert small.verdict_of("legacy_camera") is Verdict.NOT_RUN


def test_missing_cell_is_not_run_and_one_that_is_not_applicable_an_error_in_the_gate(
    report: Report,
) -> None:
    compared = tuple(item.model_copy(update={"is_gate": False}) for item in report.architectures)
    cells = without(report, "FSR-01", "camera_radar")
    empty = Cell(fsr="FSR-01", architecture="camera_radar", verdict=None, command="adeye show")
    for found, architectures, verdict in (
        (cells, report.architectures, Verdict.NOT_RUN),
        ((*cells, empty), report.architectures, Verdict.ERROR),
        # Outside of the gate it is no evidence.
        ((*cells, empty), compared, Verdict.NOT_RUN),
    ):
        parts = {"cells": found, "architectures": architectures}
        changed = rebuilt(report, **parts, exit_code=ExitCode.INCOMPLETE)
        assert changed.verdict_of("camera_radar") is verdict


def test_green_exit_code_beside_what_is_not_green_is_refused(report: Report) -> None:
    red, compared = (
        tuple(item.model_copy(update={"is_gate": flag}) for item in report.architectures)
        for flag in (True, False)
    )
    failure = ChannelFailure("camera_radar", "nominal", "channel_error", 2, 1, "KeyError", 0, "")
    changes: tuple[tuple[dict[str, Any], str], ...] = (
        ({"architectures": red}, "exit code 0, but the gate is"),
        ({"architectures": compared}, r"exit code 0, but the gate is \{\}"),
        ({"channel_failures": (failure,)}, "exit code 0, but channel_error of channel nominal"),
        ({"planned": 540, "accounted": 539}, "accounted for"),
        ({"planned": 539, "accounted": 540}, "accounted for"),
        ({"planned": 0, "accounted": 0}, "accounted for"),
    )
    for change, message in changes:
        refused(ValidationError, rebuilt, report, **change, says=message)


def test_red_exit_code_beside_a_green_gate_is_allowed(report: Report) -> None:
    assert rebuilt(report, exit_code=ExitCode.INTEGRITY).exit_code is ExitCode.INTEGRITY


def test_cell_that_contradicts_itself_is_refused() -> None:
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
    vacuous = {"verdict": Verdict.PASS, "counts": {Verdict.VACUOUS: 2}, "exercised": 0}
    changes: tuple[tuple[dict[str, Any], str], ...] = (
        ({"runs": 3}, "3 runs, but counts"),
        ({"exercised": 3}, "3 exercised"),
        ({"verdict": Verdict.PASS}, "over a failed run"),
        ({"verdict": None}, "over a failed run"),
        (vacuous, "PASS without a run that passed"),
    )
    for change, message in changes:
        refused(ValidationError, Cell, **{**fields, **change}, says=message)


def test_number_that_belongs_to_nothing_and_the_same_thing_twice_are_refused(
    report: Report,
) -> None:
    for field, message in (
        ("fsrs", "is not an FSR"),
        ("architectures", "is not an architecture"),
        ("scenarios", "is not a scenario"),
    ):
        with pytest.raises(ValidationError, match=message):
            rebuilt(report, **{field: getattr(report, field)[1:], "exit_code": ExitCode.FAILED})
    for field in ("fsrs", "architectures", "scenarios", "cells", "replays"):
        items = getattr(report, field)
        with pytest.raises(ValidationError, match="is there twice"):
            rebuilt(report, **{field: (*items, items[0])})


def test_cell_is_found_by_its_place_in_each_copy(report: Report) -> None:
    assert known(report.cell("FSR-02", "lidar", "cut_in")).verdict is Verdict.INVALID
    assert report.cell("FSR-02", "lidar", "nowhere") is None
    copy = report.model_copy(update={"cells": report.cells[:1]})
    assert copy.cell("FSR-02", "lidar") is None
    assert copy.cell(report.cells[0].fsr, report.cells[0].architecture) == report.cells[0]
    assert report.cell("FSR-02", "lidar") is not None


def test_suite_of_an_unknown_architecture_or_twice_is_refused(report: Report) -> None:
    (suite,) = report.suites
    with pytest.raises(ValidationError, match="suites: 'camera_radar' is there twice"):
        rebuilt(report, suites=(suite, suite))
    with pytest.raises(ValidationError, match="'other' is not an architecture of the report"):
        rebuilt(report, suites=(replace(suite, architecture="other"),))


def test_statement_about_what_is_not_there_is_refused(report: Report) -> None:
    for part, changes, message in (
        ("confidence", {"fsr": "FSR-99"}, "'FSR-99' is not an FSR"),
        ("confidence", {"architecture": "sonar"}, "'sonar' is not an architecture"),
        ("confidence", {"scenario": "drift"}, "'drift' is not a scenario"),
        ("step_uncertainty", {"architecture": "sonar"}, "'sonar' is not an architecture"),
        ("step_uncertainty", {"scenario": "drift"}, "'drift' is not a scenario"),
    ):
        is_claim = part == "confidence"
        told = claims(claim(**changes)) if is_claim else step(lines=(line(**changes),))
        refused(ValidationError, rebuilt, report, **{part: told}, says=message)
