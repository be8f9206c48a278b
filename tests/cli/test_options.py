"""Help texts from docstrings and examples."""

import pytest
import typer

from adeye.cli.options import add, examples, help_of
from adeye.errors import IntegrityError


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
