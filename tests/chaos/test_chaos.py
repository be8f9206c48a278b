"""Ways to lose or to falsify evidence: each ends with its exit code and names its cause.

``docs/reference/lost-evidence.md`` is the table of all of them, made by ``tests/chaos/table.py``.
"""

from __future__ import annotations

import shutil
import time
from datetime import UTC, datetime, timedelta
from typing import Any, Final

import pytest

from adeye.store import encoding
from adeye.store.evidence import verification
from adeye.store.evidence import verification as soundness
from adeye.store.repository import Repository
from adeye.store.write import queue as leasing
from tests.chaos.bench import DB, ODD_FILE, PLUGIN, Bench
from tests.chaos.stored import tally_made_green
from tests.chaos.table import GROUPS, PAGE, page
from tests.chaos.ways import Way
from tests.project import table_hash

pytestmark = pytest.mark.slow

WAYS: Final[list[Way]] = [way for ways in GROUPS.values() for way in ways]


def marked(way: Way) -> Any:
    return pytest.param(way, id=way.what, marks=[pytest.mark.slow] if way.is_slow else [])


@pytest.mark.parametrize("way", [marked(way) for way in WAYS])
def test_lost_or_false_evidence_is_never_green(bench: Bench, way: Way) -> None:
    said = way.do(bench)
    assert (said.code, way.said in said.text) == (way.code, True), said.text
    assert "defect of adeye" not in said.text
    assert "Traceback" not in said.text


def test_no_way_is_documented_as_green_and_all_differ() -> None:
    assert len(WAYS) >= 25
    assert {way.code for way in WAYS} == {1, 2, 3, 4, 5, 130}
    assert len({way.what for way in WAYS}) == len({way.do for way in WAYS}) == len(WAYS)


def test_page_lists_every_way() -> None:
    assert PAGE.read_text("utf-8") == page(), "run python -m tests.chaos.table"


def test_untouched_campaign_is_green(bench: Bench) -> None:
    said = bench.gate()
    assert (said.code, "Nothing differs from the baseline." in said.text) == (0, True)
    assert bench.run().code == 0


def test_altered_tally_would_be_green_without_the_check(bench: Bench) -> None:
    bench.monkeypatch.setattr(soundness, "unsound", lambda *_: iter(()))
    bench.monkeypatch.setattr(Repository, "require_sound", lambda *_: None)
    assert tally_made_green(bench).code == 0


def test_altered_results_would_be_green_without_verification(bench: Bench) -> None:
    bench.monkeypatch.setattr(verification, "verify", lambda *_: iter(()))
    bench.tamper("UPDATE verdict SET margin = 99 WHERE run_number = 1 AND verdict = 'VACUOUS'")
    assert bench.gate().code == 0


def test_clock_that_jumps_back_loses_nothing(bench: Bench) -> None:
    honest = table_hash(bench.folder / DB)
    (bench.folder / DB).unlink()
    moments = iter(range(10**6))

    class Jumping(datetime):
        @classmethod
        def now(cls, tz: Any = None) -> Any:
            # An hour back with every look at it.
            return datetime.now(tz or UTC) - timedelta(hours=next(moments))

    for module in (encoding, leasing):
        if hasattr(module, "datetime"):
            bench.monkeypatch.setattr(module, "datetime", Jumping)
    bench.monkeypatch.setattr(time, "time", lambda: 1e9 - next(moments))
    assert bench.run("--threads", "1").code == 0
    assert next(moments) > 0
    assert table_hash(bench.folder / DB) == honest
    assert bench.gate().code == 0


def test_plugins_with_one_file_name_are_told_apart(bench: Bench) -> None:
    """An ODD in another folder has a metric file of the same name that says something else."""
    bench.metric("pass")
    assert bench.run().code == 0
    other = bench.folder / "other"
    shutil.copytree(bench.folder / "odd", other)
    (other / "odd_metric.py").write_text(PLUGIN.format(body="values[:] = -1.0"), "utf-8")
    first = bench.adeye("run", ODD_FILE, "--db", DB, "--quiet")
    second = bench.adeye("run", "other/tested.yaml", "--db", DB, "--quiet")
    assert (first.code, second.code) == (0, 1)
    assert "FSR-06 FAIL for camera_radar" in second.text
