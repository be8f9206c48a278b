"""Help texts from docstrings and examples."""

from adeye.cli.options import examples, help_of


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
