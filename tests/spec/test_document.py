"""Strict YAML: what each word means, what is refused, and where it stands."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.errors import InputError, SourceLocation, SpecError
from adeye.spec.document import (
    MAX_BYTES,
    MAX_DEPTH,
    MAX_NODES,
    Document,
    load_document,
    parse_document,
)

if TYPE_CHECKING:
    from pathlib import Path

SOME = """\
# A comment.
odd: motorway
scenarios:
  - use: cut_in
    sweep: {gap: [10 m, 20 m]}
  - use: cut_out
"""


def read(text: str) -> Document:
    return parse_document(text, "f.yaml")


def value(text: str) -> Any:
    return read(f"a: {text}").value["a"]


def refusal(text: str) -> SpecError:
    with pytest.raises(SpecError) as caught:
        read(text)
    return caught.value


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("true", True),
        ("True", True),
        ("FALSE", False),
        ("null", None),
        ("~", None),
        ("", None),
        ("0", 0),
        ("-7", -7),
        ("+7", 7),
        ("18446744073709551615", 2**64 - 1),
        ("-9223372036854775808", -(2**63)),
        ("0.5", 0.5),
        (".5", 0.5),
        ("5.", 5.0),
        ("1e3", 1000.0),
        ("-1.5E-3", -0.0015),
        ("1e-400", 0.0),
        ("60 km/h", "60 km/h"),
        ("'5'", "5"),
        ('"true"', "true"),
        ("''", ""),
        ("|\n  no\n", "no\n"),
        ("[1, two]", [1, "two"]),
        ("{b: 1}", {"b": 1}),
    ],
)
def test_value_of_the_core_schema(text: str, meaning: object) -> None:
    found = value(text)
    assert found == meaning
    assert type(found) is type(meaning)


@pytest.mark.parametrize(
    "text",
    [
        *("yes", "no", "Yes", "NO", "on", "off", "y", "n", "tRue", "None", "nul"),
        *("017", "-017", "08", "0b11", "0X1F", "0O17", "1_000", "012.5", "0x", "--1", "+"),
        *("12:30:00", "1:30", "2020-01-01", "2020-01-01T00:00:00Z", "12e", "e3", ".", "1e"),
        *("nan", "inf", "NaN", "+.nan", "1,5", "="),
    ],
)
def test_surprise_of_yaml_1_1_stays_text(text: str) -> None:
    assert value(text) == text


@pytest.mark.parametrize(
    "text", [".nan", ".NaN", ".NAN", ".inf", "-.inf", "+.Inf", ".INF", "1e999", "-1e999"]
)
def test_number_that_is_not_finite_is_refused(text: str) -> None:
    error = refusal(f"a: {text}")
    assert str(error).startswith("SpecError: f.yaml:1:4: ")
    assert "is not a finite number" in error.message


@pytest.mark.parametrize(
    "text",
    ["18446744073709551616", "-9223372036854775809", "9" * 399, "9" * 5000],
    ids=["above", "below", "long", "longer"],
)
def test_whole_number_beyond_64_bits_is_refused(text: str) -> None:
    assert "does not fit into 64 bits" in refusal(f"a: {text}").message


@pytest.mark.parametrize("key", ["true", "1", "no", "2020-01-01", "null"])
def test_key_is_always_text(key: str) -> None:
    assert read(f"{key}: 1").value == {key: 1}


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("a: 1\nb: 2\na: 3", "3:1", "key 'a' occurs twice, first in line 1"),
        ("{a: 1, 'a': 2}", "1:8", "occurs twice"),
        ("\u00e9: 1\ne\u0301: 2", "2:1", "occurs twice, first in line 1"),
        ("a:\n  - {b: 1, b: 2}", "2:12", "key 'b' occurs twice"),
        ("a: &x {b: 1}\nc:\n  <<: *x", "3:3", "merge keys are not read"),
        ("a: &x [*x]", "1:8", "alias *x contains itself"),
        ("a: &x {b: [*x]}", "1:12", "alias *x contains itself"),
        ("a: *x", "1:4", "no valid YAML: found undefined alias"),
        ("a: 1\n---\nb: 2", "2:1", "a second document begins here"),
        ("? [1]\n: 2", "1:3", "a key must be text"),
        ("? {b: 1}\n: 2", "1:3", "a key must be text"),
        ("a: !!str 5", "1:4", "tag 'tag:yaml.org,2002:str' is not read"),
        ("a: ! 5", "1:4", "tag '!' is not read"),
        ("a: !mine {b: 1}", "1:4", "tag '!mine' is not read"),
        ("a: !!set {b}", "1:4", "is not read"),
        ("a: !!binary aGk=", "1:4", "is not read"),
        ("a: !!python/object/apply:os.system ['true']", "1:4", "is not read"),
        ("a: 1\n!!str b: 2", "2:1", "is not read"),
        ("%YAML 1.1\n---\na: no", "1:1", "this is YAML 1.1"),
        ("", "1:1", "the document is empty"),
        ("# nothing\n", "1:1", "the document is empty"),
        ("a: [1", "1:6", "no valid YAML"),
        ("b: 1\na: [1\n", "3:1", "no valid YAML"),
        ("a: b: c", "1:5", "no valid YAML"),
        ("\ta: 1", "1:1", "no valid YAML"),
        ("a: 1\nb: x\x00y", "2:5", "character U+0000 cannot stand in YAML"),
        ("a: \x1b[31m", "1:4", "character U+001B cannot stand in YAML"),
        ("a: \ud800", "1:4", "character U+D800 cannot stand in YAML"),
    ],
)
def test_refusal_says_what_and_where(text: str, place: str, message: str) -> None:
    error = refusal(text)
    assert str(error).startswith(f"SpecError: f.yaml:{place}: ")
    assert message in error.message


def test_alias_repeats_its_anchor() -> None:
    found = read("a: &x {b: [1]}\nc: *x")
    assert found.value == {"a": {"b": [1]}, "c": {"b": [1]}}
    found.value["a"]["b"].append(2)
    assert found.value["c"] == {"b": [1]}
    assert found.locate(("c", "b", 0)) == SourceLocation("f.yaml", 1, 12)


def test_quoted_less_than_is_a_key() -> None:
    assert read("'<<': 1").value == {"<<": 1}


def test_yaml_1_2_may_say_so() -> None:
    assert read("%YAML 1.2\n---\na: no").value == {"a": "no"}


def test_byte_order_mark_is_skipped() -> None:
    assert read("\ufeffa: 1").value == {"a": 1}


@pytest.mark.parametrize(
    ("loc", "line", "column"),
    [
        ((), 2, 1),
        (("odd",), 2, 6),
        (("scenarios", 0), 4, 5),
        (("scenarios", 0, "sweep", "gap", 1), 5, 25),
        (("scenarios", 1, "use"), 6, 10),
        (("scenarios", 1, "sweep", "gap"), 6, 5),
        (("scenarios", 7), 4, 3),
        (("unknown", "part"), 2, 1),
    ],
)
def test_place_of_a_part_or_of_the_nearest_above(
    loc: tuple[str | int, ...], line: int, column: int
) -> None:
    assert read(SOME).locate(loc) == SourceLocation("f.yaml", line, column)


def test_place_of_a_key() -> None:
    document = read(SOME)
    assert document.locate_key(("scenarios", 0, "sweep")) == SourceLocation("f.yaml", 5, 5)
    assert document.locate_key(("scenarios", 1, "sweep")) == SourceLocation("f.yaml", 6, 5)


def laughs(levels: int, width: int) -> str:
    """Write lists of aliases of lists of aliases."""
    lines = (f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * width)}]" for k in range(1, levels + 1))
    return "\n".join(["a0: &a0 [x, x]", *lines])


def mapping_laughs(levels: int) -> str:
    lines = (f"a{k}: &a{k} {{x: *a{k - 1}, y: *a{k - 1}}}" for k in range(1, levels + 1))
    return "\n".join(["a0: &a0 {x: 1, y: 2}", *lines])


def repeated(size: int) -> str:
    """Repeat one long list many times."""
    return f"a: &a [{'x, ' * size}x]\nb: [{', '.join(['*a'] * (MAX_NODES // size + 1))}]"


BOMBS = [
    *(laughs(levels, 2) for levels in range(16, 46)),
    *(laughs(levels, 10) for levels in range(5, 25)),
    *(mapping_laughs(levels) for levels in range(16, 46)),
    *(repeated(size) for size in range(1000, 20_000, 2000)),
    *(opening * 100_000 for opening in ("[", "{", "- ", "? ", "{a: ")),
    "\n".join(" " * depth + "a:" for depth in range(900)),
    "[" + "x," * 450_000 + "]",
    "[" * 900 + "]" * 900,
    "a: [" + "a: b, " * 150_000 + "]",
    "a: " + "&a " * 300_000,
]


@pytest.mark.slow
def test_a_hundred_bombs_are_refused_at_once() -> None:
    assert len(BOMBS) >= 100
    for bomb in BOMBS:
        begin = time.process_time()
        error = refusal(bomb)
        assert time.process_time() - begin < 1.0
        assert error.where is not None
        assert len(str(error)) < 300


def test_depth_is_capped() -> None:
    assert read("[" * MAX_DEPTH + "]" * MAX_DEPTH).value
    assert refusal("[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1)).where == SourceLocation(
        "f.yaml", 1, MAX_DEPTH + 1
    )


@pytest.mark.slow
def test_nodes_are_capped_with_aliases_counted() -> None:
    # The outer list, the inner list of 9 and its aliases: 1 + 10 * n nodes.
    def document(repeats: int) -> str:
        return "[&a [1, 2, 3, 4, 5, 6, 7, 8, 9]" + ", *a" * (repeats - 1) + "]"

    fits = (MAX_NODES - 1) // 10
    assert len(read(document(fits)).value) == fits
    assert "more than 100,000 values, aliases included" in refusal(document(fits + 1)).message


def test_bytes_are_capped(tmp_path: Path) -> None:
    path = tmp_path / "large.yaml"
    path.write_text("a: " + "x" * (MAX_BYTES - 3), encoding="utf-8")
    assert len(load_document(path).value["a"]) == MAX_BYTES - 3
    path.write_text("a: " + "x" * (MAX_BYTES - 2), encoding="utf-8")
    with pytest.raises(SpecError, match="more than 1,000,000 bytes"):
        load_document(path)
    with pytest.raises(SpecError, match="more than 1,000,000 bytes"):
        read("a: " + "\u00e9" * (MAX_BYTES // 2))


def test_file_is_read_with_its_path(tmp_path: Path) -> None:
    path = tmp_path / "odd.yaml"
    path.write_text(SOME, encoding="utf-8")
    document = load_document(path)
    assert document.value == read(SOME).value
    assert document.locate(("odd",)) == SourceLocation(str(path), 2, 6)


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SpecError) as caught:
        load_document(tmp_path / "none.yaml")
    assert str(caught.value) == (
        f"SpecError: {tmp_path}/none.yaml:1:1: there is no such file. Check the path."
    )


def test_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="this is a folder, not a file"):
        load_document(tmp_path)


def test_pipe_without_a_writer_does_not_hang(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(SpecError, match="not a regular file"):
        load_document(tmp_path / "pipe")


@pytest.mark.parametrize("name", ["a\0b", "x" * 5000, "file.yaml/below"])
def test_impossible_path_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "file.yaml").write_text("a: 1", encoding="utf-8")
    with pytest.raises(SpecError):
        load_document(tmp_path / name)


@pytest.mark.parametrize(
    ("content", "place"),
    [
        (b"a: 1\nb: \xff", "2:4"),
        (b"\xe9: 1", "1:1"),
        (b"a: \xc3\xa9 \xc3", "1:6"),
        ("a: 1".encode("utf-16"), "1:1"),
    ],
)
def test_file_that_is_not_utf_8_is_refused_at_the_byte(
    tmp_path: Path, content: bytes, place: str
) -> None:
    path = tmp_path / "latin.yaml"
    path.write_bytes(content)
    with pytest.raises(SpecError) as caught:
        load_document(path)
    assert str(caught.value).startswith(f"SpecError: {path}:{place}: byte 0x")


PIECES = [
    *("a", "b: ", "- ", "? ", ": ", "[", "]", "{", "}", ", ", "\n", "\n  ", "'", '"', "#", "|\n"),
    *(
        "&a ",
        "*a",
        "<<: ",
        "!!str ",
        "!x ",
        "---\n",
        "...\n",
        "%YAML 1.2\n",
        "1",
        ".nan",
        "~",
        "\t",
    ),
    *("0x", "\u00e9", "\u2028", "\x00", "\ud800", ">-\n", "@", "`"),
]


@pytest.mark.slow
@settings(max_examples=400)
@given(st.text(max_size=40) | st.lists(st.sampled_from(PIECES), max_size=20).map("".join))
def test_any_text_is_a_document_or_an_input_error_with_its_place(text: str) -> None:
    try:
        document = read(text)
    except InputError as error:
        place = error.where
    else:
        place = document.locate(())
    assert place is not None
    assert place.path == "f.yaml"
    assert place.line >= 1
    assert place.column >= 1


@pytest.mark.slow
@settings(max_examples=200)
@given(st.binary(max_size=60))
def test_any_bytes_are_a_document_or_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, content: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.yaml"
    path.write_bytes(content)
    try:
        assert load_document(path).path == str(path)
    except SpecError as error:
        message = str(error)
        assert message.startswith(f"SpecError: {path}:")
