"""``adeye preventability``: the table, the findings, and what it refuses."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pathlib import Path

    from tests.project import Executed


@pytest.fixture
def db(folder: Path, mini: Executed) -> str:
    """A copy of the mini campaign, which may be written to."""
    shutil.copyfile(mini.db, folder / "adeye.db")
    return str(folder / "adeye.db")


@pytest.mark.slow
def test_findings_are_listed_with_their_commands(adeye: Any, db: str) -> None:
    done = adeye("preventability", "--db", db, "--model", "cc,rss")
    assert done.code == 0, done.err
    assert "Only the model" in done.out
    assert "findings, avoided by the model only:" in done.out
    assert done.out.count("adeye replay ") == 2
    assert "m/s² required), without faults" in done.out
    drive = done.out.splitlines()[-3].split()[2]
    shown = adeye("show", drive, "--db", db, "--json").document
    assert shown["architecture"] in {"reference_cc", "reference_rss"}


@pytest.mark.slow
def test_json_has_every_run(adeye: Any, db: str) -> None:
    found = adeye("preventability", "1", "--db", db, "--all", "--json").document
    assert found["edition"] == "r157-01"
    assert len(found["comparisons"]) == found["executed"] == found["looked_at"]["cc"] == 28
    cells = [item["cell"] for item in found["comparisons"]]
    assert "only_model" in cells
    assert "unknown" not in cells


@pytest.mark.slow
def test_without_a_conflict_it_says_so(adeye: Any, db: str) -> None:
    run = adeye("query", "SELECT run FROM v_runs WHERE contact = 0", "--db", db, "--format", "csv")
    one = run.out.split()[1]
    alone = adeye("preventability", one, "--db", db)
    assert "No finding" in alone.out


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--model", "rrs"], "Did you mean 'rss'?"),
        (["--edition", "r157-1"], "Did you mean 'r157-01'?"),
        (["--threshold", "4"], "no unit"),
        (["ffff0000"], "there is none"),
    ],
)
def test_bad_input_is_refused(adeye: Any, db: str, options: list[str], text: str) -> None:
    done = adeye("preventability", "--db", db, *options)
    assert done.code == 2
    assert text in done.err
