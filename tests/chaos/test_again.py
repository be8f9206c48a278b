"""Asking again changes nothing: not the verdict, not a row, not a byte of the report."""

from __future__ import annotations

import shutil
from typing import Final

import pytest

from tests.chaos.bench import BASELINE, DB, Bench
from tests.chaos.runners import record, size
from tests.chaos.test_torn import dumped

pytestmark = [pytest.mark.chaos, pytest.mark.slow]

TIMES: Final = size(20, 1_000)


def test_gate_says_the_same_every_time(bench: Bench) -> None:
    first = bench.gate()
    assert first.code == 0
    before = dumped(bench.folder / DB)
    flips = sum(bench.gate() != first for _ in range(TIMES))
    assert flips == 0
    assert dumped(bench.folder / DB) == before
    record("gate again and again", times=TIMES, flips=flips)


def test_gate_that_fails_says_the_same_every_time(bench: Bench) -> None:
    with bench.fsr("FSR-06") as fsr:
        fsr["formula"] = "always(abs(ego.lane_offset) <= 0.001 m)"
    assert bench.run().code == 1
    first = bench.gate()
    assert first.code == 1
    assert all(bench.gate() == first for _ in range(TIMES))


def test_running_and_reporting_again_changes_nothing(bench: Bench) -> None:
    # The campaign was run from another folder, from which its parts have other paths.
    assert bench.run().code == 0
    before = dumped(bench.folder / DB)
    forms = {"-o": "report.html", "--junit": "junit.xml", "--report-json": "report.json"}
    options = [word for option, name in forms.items() for word in (option, name)]
    kept: list[list[bytes]] = []
    for number in range(size(2, 20)):
        assert "Executed nothing" in bench.run("--threads", str(1 + number % 2)).text
        assert bench.adeye("report", "--db", DB, *options, "--quiet").code == 0
        kept.append([(bench.folder / name).read_bytes() for name in forms.values()])
        assert dumped(bench.folder / DB) == before
    assert all(files == kept[0] for files in kept)
    # Nor does it matter where the database lies.
    elsewhere = bench.folder / "elsewhere" / DB
    elsewhere.parent.mkdir()
    shutil.copy(bench.folder / DB, elsewhere)
    arguments = ("--db", str(elsewhere), "--baseline", BASELINE)
    assert bench.adeye("gate", *arguments).code == 0
    record("run and report again", times=len(kept), rows_changed=0)
