"""Tokens and the parser: what binds tighter, and what is refused rather than guessed."""

import pytest

from adeye.errors import ExpressionError, SourceLocation
from adeye.judge.stl import syntax
from adeye.judge.stl.parser import MAX_DEPTH, MAX_TOKENS, parse_with, scan
from tests.refusals import refused
from tests.stored import stored

TABLES = stored("formulas")


def test_a_quantity_is_one_token_in_si() -> None:
    for text, value, exponents in (
        ("2 s", 2.0, (0, 1, 0)),
        ("250ms", 0.25, (0, 1, 0)),
        ("2 min", 120.0, (0, 1, 0)),
        ("36 km/h", 10.0, (1, -1, 0)),
        ("4 m/s^2", 4.0, (1, -2, 0)),
        ("4 m/s2", 4.0, (1, -2, 0)),
        ("4 m/s²", 4.0, (1, -2, 0)),
        ("180 deg", 3.141592653589793, (0, 0, 1)),
    ):
        token, end = scan(text)
        assert (token.kind, token.text) == ("number", text)
        assert token.value == pytest.approx(value, rel=1e-15), text
        assert (token.exponents, token.has_unit) == (tuple(exponents), True), text
        assert (end.kind, end.text, end.span) == ("end", "", (len(text), len(text)))


@pytest.mark.parametrize("text", ["2", "2.5", ".5", "1e-3", "3."])
def test_a_bare_number_has_no_unit(text: str) -> None:
    token = scan(text)[0]
    assert (token.value, token.has_unit, token.exponents) == (float(text), False, (0, 0, 0))


def test_a_length_divided_by_a_signal_is_no_speed() -> None:
    assert [token.text for token in scan("10 m/speed")] == ["10 m", "/", "speed", ""]


def test_a_connective_after_a_number_is_no_unit() -> None:
    assert [token.text for token in scan("2 and x")] == ["2", "and", "x", ""]


def test_names_have_dots_and_symbols_are_longest_first() -> None:
    tokens = scan("channel.nominal.status!=ok<=a")
    assert [token.text for token in tokens] == ["channel.nominal.status", "!=", "ok", "<=", "a", ""]
    assert [token.kind for token in tokens[:3]] == ["word", "symbol", "word"]


def test_what_is_not_the_language_is_refused_at_its_place() -> None:
    for text, column, remedy in TABLES["what is not the language is refused at its place"]:
        where = SourceLocation("concept.yaml", 7, 3)
        caught = refused(ExpressionError, scan, text, where)
        assert f"character {column}:" in caught.message
        assert remedy in caught.remedy
        assert caught.where == where


def shape(node: syntax.Node) -> str:  # noqa: C901, PLR0911 - one for each kind of node
    """Write a tree with all its parentheses."""
    match node:
        case syntax.Constant():
            return f"{node.value:g}"
        case syntax.Signal() | syntax.Assertion():
            return node.name
        case syntax.Arithmetic():
            parts = " ".join(shape(operand) for operand in node.operands)
            return f"({node.operator} {parts})"
        case syntax.Comparison() | syntax.Connective():
            return f"({shape(node.left)} {node.operator} {shape(node.right)})"
        case syntax.Equality():
            return f"({shape(node.left)} {'!=' if node.is_negated else '=='} {shape(node.right)})"
        case syntax.Not():
            return f"(not {shape(node.operand)})"
        case syntax.Edge():
            return f"({node.operator} {shape(node.operand)})"
        case syntax.Previous():
            return f"(previous {shape(node.operand)})"
        case syntax.Temporal() | syntax.Past() | syntax.Until() | syntax.Since():
            window = node.window
            span = f"[{window.first_s:g},{window.last_s:g}]" if window else ""
            if isinstance(node, syntax.Until | syntax.Since):
                word = "until" if isinstance(node, syntax.Until) else "since"
                return f"({shape(node.left)} {word}{span} {shape(node.right)})"
            return f"({node.operator}{span} {shape(node.operand)})"


@pytest.mark.parametrize(("text", "tree"), TABLES["a text has one reading"])
def test_a_text_has_one_reading(text: str, tree: str) -> None:
    assert shape(parse_with({}, text)[0]) == tree


def test_every_node_quotes_what_was_written() -> None:
    text = "always ((x + y) * 2 > 1 m and (a or b))"
    root = parse_with({}, text)[0]
    assert isinstance(root, syntax.Temporal)
    assert isinstance(root.operand, syntax.Connective)
    left = root.operand.left
    assert isinstance(left, syntax.Comparison)
    assert text[slice(*left.span)] == "(x + y) * 2 > 1 m"
    assert text[slice(*left.left.span)] == "(x + y) * 2"
    assert text[slice(*root.operand.right.span)] == "a or b"


@pytest.mark.parametrize(
    ("text", "column", "what"), TABLES["what is no formula is refused at its place"]
)
def test_what_is_no_formula_is_refused_at_its_place(
    text: str, column: int | None, what: str | None
) -> None:
    if column is None:
        assert shape(parse_with({}, text)[0]) == text
        return
    where = SourceLocation("concept.yaml", 12, 5)
    caught = refused(ExpressionError, parse_with, {}, text, where)
    assert f"formula '{text}', character {column}: " in caught.message
    assert what is not None
    assert what in caught.message
    assert str(caught).startswith("ExpressionError: concept.yaml:12:5: formula")


def test_a_formula_too_deep_or_long_is_refused_and_never_overflows() -> None:
    for text in (
        "(" * (MAX_DEPTH + 1) + "a" + ")" * (MAX_DEPTH + 1),
        "not " * (MAX_DEPTH + 1) + "a",
        " and ".join(["a"] * MAX_TOKENS),
    ):
        refused(ExpressionError, parse_with, {}, text, says="Split the formula")


def test_parameters_stand_for_constants_in_terms_and_windows() -> None:
    parameters = {"tau": (1.5, (0, 1, 0)), "low": (2.0, (1, 0, 0)), "idle": (0.0, (0, 0, 0))}
    root, used = parse_with(parameters, "always(gap > 2 * low or once[0 s, tau](a))")
    assert shape(root) == "(always ((gap > (* 2 2)) or (once[0,1.5] a)))"
    assert used == {"tau", "low"}


@pytest.mark.parametrize(("text", "message"), TABLES["a parameter that does not fit is refused"])
def test_a_parameter_that_does_not_fit_is_refused(text: str, message: str) -> None:
    with pytest.raises(ExpressionError, match=message):
        parse_with({"tau": (1.5, (0, 1, 0)), "low": (2.0, (1, 0, 0))}, text)


def test_since_twice_is_refused() -> None:
    for text in ("a since b since c", "a until b since c"):
        refused(ExpressionError, parse_with, {}, text, says="can be read in two ways")


def test_looking_back_at_a_connective_needs_parentheses() -> None:
    for text in ("once a and b", "historically[0 s, 1 s] a implies b"):
        refused(ExpressionError, parse_with, {}, text, says="can be read in two ways")
