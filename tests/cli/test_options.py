"""Help texts from docstrings and examples; what ends a verb that was not foreseen."""

import shutil
import sqlite3
from pathlib import Path

import pytest
import typer

from adeye.cli.options import add, examples, texts_of
from adeye.errors import IntegrityError
from tests.project import Executed
from tests.tampering import unguarded


def verb() -> None:
    """Do a thing.

    A long paragraph that
    is wrapped in the source.

    Exit codes: 0.

    Parameters:
        a: What it is: short.
        b: Another, which is
            long.

    Examples:
        adeye verb
        adeye verb --a 1
            --b 2
    """


def test_docstring_is_the_help() -> None:
    texts = texts_of(verb)
    assert texts.help.split("\n\n") == [
        "Do a thing.",
        "A long paragraph that is wrapped in the source.",
        "Exit codes: 0.",
    ]
    assert texts.parameters == {"a": "What it is: short.", "b": "Another, which is long."}
    assert texts.examples == ["adeye verb", "adeye verb --a 1 --b 2"]


def test_examples_are_one_a_line() -> None:
    assert examples("adeye a", "adeye b").splitlines() == ["Examples:", "  adeye a", "  adeye b"]


def leaves() -> None:
    """Leave as code from outside may."""
    raise SystemExit(0)


def test_process_that_is_asked_to_end_from_outside_did_not_succeed() -> None:
    app = typer.Typer()
    add(app, leaves)
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
    add(app, breaks)
    with pytest.raises(blamed):
        typer.main.get_command(app).main([str(path)], standalone_mode=False)
