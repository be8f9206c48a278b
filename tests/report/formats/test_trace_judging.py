"""What is written of a run's signals is judged as the run was: the FSRs have the same verdicts."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import adeye
from adeye.campaign.replay import Recorded, recorded
from adeye.judge.stl.table import JudgedTable, Reading, judge_table, read_table
from adeye.judge.verdict import Verdict
from adeye.report.formats.traces import FORMS, TraceTable, trace_table, write_trace_table
from tests.project import Executed

DECIDED = (Verdict.PASS, Verdict.FAIL, Verdict.VACUOUS, Verdict.INCONCLUSIVE)


@pytest.fixture(scope="module", params=["few", pytest.param("all", marks=pytest.mark.slow)])
def runs(mini: Executed, request: pytest.FixtureRequest) -> list[tuple[Recorded, TraceTable]]:
    """A run of each architecture without and with faults: passed, failed, cut short by contact.

    Where a few do, of them those with verdicts that none before has.
    """
    rows = {(row["architecture"], row["fault_entry"]): row for row in mini.project.rows()}
    chosen, seen = [], set[str]()
    for row in rows.values():
        given = set(row["verdicts"].values())
        if request.param == "all" or not given <= seen:
            chosen.append(row["run"])
            seen |= given
    with mini.opened() as (repository, _):
        found = [recorded(repository, repository.find_run(run)) for run in chosen]
    return [(item, trace_table(item.signals, 0, {})) for item in found]


def compare(done: Recorded, judge: Any) -> set[Verdict]:
    """Judge every formula of a run's FSRs, and compare with the stored verdicts."""
    stored = {item.fsr_id: item for item in done.stored.verdicts}
    seen = set()
    for item in done.requirements:
        record = stored.get(item.id)
        if item.formula is None or record is None or record.verdict not in DECIDED:
            continue
        found: JudgedTable = judge(item.formula, dict(item.parameters))
        assert found.verdict is record.verdict, (item.id, found.judgement, record)
        if record.time_s is not None:
            assert found.judgement.time_s == pytest.approx(record.time_s, abs=1e-9)
        seen.add(record.verdict)
    return seen


def test_data_frame_has_the_verdicts_of_every_fsr(runs: list[tuple[Recorded, TraceTable]]) -> None:
    seen = set()
    for done, table in runs:
        frame = table.frame()
        seen |= compare(done, lambda text, given: adeye.stl(text, frame, parameters=given))  # noqa: B023
    assert {Verdict.PASS, Verdict.FAIL, Verdict.INCONCLUSIVE} <= seen


@pytest.mark.parametrize("form", [form for form in FORMS if form != "jsonl"])
def test_file_has_the_verdicts_of_every_fsr(
    runs: list[tuple[Recorded, TraceTable]], tmp_path: Path, form: str
) -> None:
    # Of CSV alone, the horizon has to be told.
    horizon = {"csv": True}.get(form, False)
    for at, (done, table) in enumerate(runs):
        path = tmp_path / f"run{at}.{form}"
        write_trace_table(table, path, form)
        read = read_table(path)
        assert compare(
            done,
            lambda text, given: judge_table(
                text,
                read,  # noqa: B023
                Reading(parameters=given, horizon=table.horizon if horizon else None),  # noqa: B023
            ),
        )


def test_samples_are_those_that_were_judged(runs: list[tuple[Recorded, TraceTable]]) -> None:
    for done, table in runs:
        frame = table.frame()
        rows = int(done.signals.trace.length[0])
        for name in ("time", "ego.speed", "ego.lane_offset"):
            np.testing.assert_array_equal(frame[name], done.signals.series(name).values[0, :rows])
        assert frame.attrs["units"]["ego.speed"] == "m/s"
        free = frame["ttc.status"] == "no_conflict"
        assert free.any()
        assert frame["ttc"][free].isna().all()
