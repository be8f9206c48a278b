"""Which run a verb is about: ``--worst FSR``, ``--last-failed``, and neither of them twice."""

from pathlib import Path
from typing import Any

import pytest

from adeye.store.read.query import run_query
from tests.project import Executed

WORST = """
SELECT v.run FROM v_verdicts v WHERE v.fsr = '{fsr}' AND v.verdict IN ('PASS', 'FAIL')
ORDER BY v.verdict = 'PASS', v.robustness_low, v.run LIMIT 1
"""


@pytest.mark.parametrize("verb", ["show", "trace", "timeline"])
def test_worst_run_of_an_fsr_is_told_and_meant(adeye: Any, mini: Executed, verb: str) -> None:
    ((run,),) = run_query(mini.db, WORST.format(fsr="FSR-02")).rows
    ended = adeye(verb, "--worst", "FSR-02", "--db", str(mini.db), "--json").ok
    assert ended.document.get("run", run) == run
    assert f"note: run {run[:10]}, the worst of FSR-02 in campaign 1 of mini\n" in ended.err


def test_last_failed_is_the_worst_of_the_first_fsr_that_fails(
    adeye: Any, mini: Executed, folder: Path
) -> None:
    rows = run_query(mini.db, "SELECT DISTINCT fsr FROM v_verdicts WHERE verdict = 'FAIL'").rows
    first = min(fsr for (fsr,) in rows)
    ended = adeye("show", "--last-failed", "--db", str(mini.db)).ok
    assert f"the worst of {first} in campaign 1" in ended.err
    asked = adeye(
        "plot", "--worst", "FSR-02", "ttc", "-o", str(folder / "w.svg"), "--db", str(mini.db)
    )
    assert (folder / "w.svg").is_file(), asked.err


def test_run_is_named_in_one_way(adeye: Any, mini: Executed) -> None:
    db = ("--db", str(mini.db))
    for words in ((), ("3f2a", "--last-failed"), ("--worst", "FSR-02", "--last-failed")):
        assert "which run?" in adeye("show", *words, *db).refused
    assert "no FSR 'FSR-99'" in adeye("replay", "--worst", "FSR-99", *db).refused
    assert "which signals?" in adeye("plot", "3f2a", *db, "-o", "x.svg").refused
