"""``judge``: what it prints, and what it executes: nothing unless asked to."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pathlib import Path

    from tests.project import Executed


@pytest.mark.slow
def test_judged_results_are_left_alone(adeye: Any, mini: Executed, tmp_path: Path) -> None:
    db = tmp_path / "copy.db"
    shutil.copyfile(mini.db, db)
    done = adeye("judge", str(mini.project.odd), "--db", str(db), "--quiet")
    assert done.code == int(mini.summary.exit_code), done.err
    assert "All 28 results were judged already; 0 executed." in done.out
    found = adeye("judge", str(mini.project.odd), "--db", str(db), "--json", "--quiet").document
    assert (found["executed"], found["replayed"], found["to_replay"]) == (0, 0, 0)


def test_database_has_to_be_there(adeye: Any, mini: Executed, tmp_path: Path) -> None:
    done = adeye("judge", str(mini.project.odd), "--db", str(tmp_path / "no.db"))
    assert done.code == 2
    assert not (tmp_path / "no.db").exists()
