"""Help texts from docstrings and examples; what ends a verb that was not foreseen."""

import shutil
import sqlite3
from pathlib import Path

import pytest
import typer

from adeye.cli.options import add, examples, help_of
from adeye.errors import IntegrityError
from tests.project import Executed
from tests.tampering import unguarded


def verb() -> None:
    """Do a thing.

    A long paragraph that
    is wrapped in the source.

    Exit codes: 0.
    """


def test_paragraph_becomes_one_line() -> None:
    assert help_of(verb).split("\n\n") == [
        "Do a thing.",
        "A long paragraph that is wrapped in the source.",
        "Exit codes: 0.",
    ]


def test_examples_are_one_a_line() -> None:
    assert examples("adeye a", "adeye b").splitlines() == ["Examples:", "  adeye a", "  adeye b"]


def leaves() -> None:
    """Leave as code from outside may."""
    raise SystemExit(0)


def test_process_that_is_asked_to_end_from_outside_did_not_succeed() -> None:
    app = typer.Typer()
    add(app, leaves, "adeye leaves")
    with pytest.raises(IntegrityError, match="asked to end the process with 0"):
        typer.main.get_command(app).main([], standalone_mode=False)


def breaks(db: Path) -> None:
    """Break after everything was read."""
    raise KeyError(str(db))


@pytest.mark.parametrize(
    ("alteration", "blamed"),
    [("SELECT 1", KeyError), ("UPDATE metric SET contact_time_s = 99.0", IntegrityError)],
)
def test_verb_that_breaks_blames_an_altered_database(
    tmp_path: Path, mini: Executed, alteration: str, blamed: type[Exception]
) -> None:
    path = tmp_path / "a.db"
    shutil.copyfile(mini.db, path)
    raw = sqlite3.connect(path)
    with unguarded(raw):
        raw.execute(alteration)
    raw.commit()
    raw.close()
    app = typer.Typer()
    add(app, breaks, "adeye breaks a.db")
    with pytest.raises(blamed):
        typer.main.get_command(app).main([str(path)], standalone_mode=False)
