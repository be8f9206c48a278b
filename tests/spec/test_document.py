"""Documents: strict YAML, and what pydantic finds wrong, with places."""

import os
import time
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, Field, ValidationError, model_validator

from adeye.errors import InputError, InputErrors, SourceLocation, SpecError
from adeye.spec.document import (
    MAX_BYTES,
    MAX_DEPTH,
    MAX_LISTED,
    MAX_NODES,
    Document,
    load_document,
    misplaced,
    parse_document,
    repeated,
    validate,
)
from adeye.spec.quantity import Condition, Identifier, Length, Many, Record, Speed
from tests.refusals import refused
from tests.stored import known, stored

TABLES = stored("definitions")


# --- Strict YAML: what each word means, what is refused, and where it stands ----------------------

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
    return refused(SpecError, read, text)


@pytest.mark.parametrize(("text", "meaning"), TABLES["value of the core schema"])
def test_value_of_the_core_schema(text: str, meaning: object) -> None:
    found = value(text)
    assert found == meaning
    assert type(found) is type(meaning)


@pytest.mark.parametrize("text", TABLES["surprise of yaml 1 1 stays text"])
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


def test_key_is_always_text_and_may_be_quoted_or_follow_what_says_no_more() -> None:
    for key in ("true", "1", "no", "2020-01-01", "null", "<<"):
        text = "'<<'" if key == "<<" else key
        assert read(f"{text}: 1").value == {key: 1}
    assert read("%YAML 1.2\n---\na: no").value == {"a": "no"}
    assert read("\ufeffa: 1").value == {"a": 1}


@pytest.mark.parametrize(("text", "place", "message"), TABLES["refusal says what and where"])
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


@pytest.mark.parametrize(
    ("loc", "line", "column"), TABLES["place of a part or of the nearest above"]
)
def test_place_of_a_part_or_of_the_nearest_above(
    loc: list[str | int], line: int, column: int
) -> None:
    assert read(SOME).locate(tuple(loc)) == SourceLocation("f.yaml", line, column)


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


def long_list_repeated(size: int) -> str:
    """Repeat one long list many times."""
    return f"a: &a [{'x, ' * size}x]\nb: [{', '.join(['*a'] * (MAX_NODES // size + 1))}]"


BOMBS = [
    *(laughs(levels, 2) for levels in range(16, 46)),
    *(laughs(levels, 10) for levels in range(5, 25)),
    *(mapping_laughs(levels) for levels in range(16, 46)),
    *(long_list_repeated(size) for size in range(1000, 20_000, 2000)),
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
    error = refusal("[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1))
    assert error.where == SourceLocation("f.yaml", 1, MAX_DEPTH + 1)


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
    refused(SpecError, load_document, path, says="more than 1,000,000 bytes")
    refused(SpecError, read, "a: " + "\u00e9" * (MAX_BYTES // 2), says="more than 1,000,000 bytes")


def test_file_is_read_with_its_path(tmp_path: Path) -> None:
    path = tmp_path / "odd.yaml"
    path.write_text(SOME, encoding="utf-8")
    document = load_document(path)
    assert document.value == read(SOME).value
    assert document.locate(("odd",)) == SourceLocation(str(path), 2, 6)


def test_what_is_no_file_is_refused_and_a_pipe_without_a_writer_does_not_hang(
    tmp_path: Path,
) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path, said in (
        (tmp_path / "none", "none: there is no such file. Check the path."),
        (tmp_path, "this is a folder, not a file"),
        (tmp_path / "pipe", "not a regular file"),
    ):
        refused(SpecError, load_document, path, says=said)


def test_impossible_path_is_refused(tmp_path: Path) -> None:
    for name in ("a\0b", "x" * 5000, "file.yaml/below"):
        (tmp_path / "file.yaml").write_text("a: 1", encoding="utf-8")
        refused(SpecError, load_document, tmp_path / name)


def test_file_that_is_not_utf_8_is_refused_at_the_byte(tmp_path: Path) -> None:
    path = tmp_path / "latin.yaml"
    for content, place in (
        (b"a: 1\nb: \xff", "2:4"),
        (b"\xe9: 1", "1:1"),
        (b"a: \xc3\xa9 \xc3", "1:6"),
        ("a: 1".encode("utf-16"), "1:1"),
    ):
        path.write_bytes(content)
        refused(SpecError, load_document, path, says=f"{path}:{place}: byte 0x")


PIECES = [
    *("a", "b: ", "- ", "? ", ": ", "[", "]", "{", "}", ", ", "\n", "\n  ", "'", '"', "#", "|\n"),
    *("&a ", "*a", "<<: ", "!!str ", "!x ", "---\n", "...\n", "%YAML 1.2\n", "1", ".nan", "~"),
    *("\t", "0x", "\u00e9", "\u2028", "\x00", "\ud800", ">-\n", "@", "`"),
]


@settings(max_examples=400)
@given(st.text(max_size=40) | st.lists(st.sampled_from(PIECES), max_size=20).map("".join))
def test_any_text_is_a_document_or_an_input_error_with_its_place(text: str) -> None:
    try:
        place = known(read(text).locate(()))
    except InputError as error:
        place = known(error.where)
    assert (place.path, place.line >= 1, place.column >= 1) == ("f.yaml", True, True)


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


# --- Validation: every problem with its line, its value, what is allowed and the nearest word -----


class Camera(Record):
    """One member of a union."""

    kind: Literal["camera"]
    range: Length
    width: int = 640


class Radar(Record):
    """Another member."""

    kind: Literal["radar"]
    range: Length
    gain: float = 1.0


BuiltIn = Annotated[Camera | Radar, Field(discriminator="kind")]


class Plugin(Record):
    """A member that a pattern tells from the others."""

    kind: Annotated[str, Field(pattern=r"^\w+:\w+$")]
    options: dict[str, int] = Field(default_factory=dict)


class Rig(Record):
    """A document with one field of each sort."""

    rig: Identifier
    speed: Speed
    design: Literal["zip", "list", "full_factorial"] = "zip"
    when: Condition | None = None
    sensors: dict[Identifier, BuiltIn | Plugin] = Field(default_factory=dict)
    faults: Many[Identifier | Annotated[Many[Identifier], Field(min_length=2)]] = ()
    limit: float | int | None = None


GOOD = """\
rig: front
speed: 60 km/h
sensors:
  eye: {kind: camera, range: 80 m}
  beam: {kind: radar, range: 150 m}
  mine: {kind: pack:Sensor, options: {a: 1}}
faults: [one, [two, three]]
"""


def problems(text: str) -> list[str]:
    """Validate and return the lines of the error, without its class and the file."""
    caught = refused(InputError, validate, parse_document(text, "f.yaml"), Rig)
    lines = str(caught).splitlines()
    if isinstance(caught, InputErrors):
        assert lines.pop() == f"{len(lines)} errors."
    assert all(line.startswith("SpecError: f.yaml:") for line in lines)
    return [line.removeprefix("SpecError: f.yaml:") for line in lines]


def changed(old: str, new: str) -> list[str]:
    """Validate the good document with one part replaced."""
    assert old in GOOD
    return problems(GOOD.replace(old, new))


def test_good_document_becomes_a_record() -> None:
    rig = validate(parse_document(GOOD, "f.yaml"), Rig)
    assert rig.speed == 60 / 3.6
    assert rig.faults == ("one", ("two", "three"))
    assert isinstance(rig.sensors["beam"], Radar)


@pytest.mark.parametrize(
    ("old", "new", "lines"), TABLES["problem of a document says place value and remedy"]
)
def test_problem_says_place_value_and_remedy(old: str, new: str, lines: list[str]) -> None:
    assert changed(old, new) == lines


def test_wrong_key_of_a_mapping_is_placed_at_the_key() -> None:
    (line,) = changed("  eye:", "  Eye-1:")
    assert line.startswith("4:3: sensors.Eye-1: must be lower case letters")
    assert line.endswith("(key 'Eye-1').")


def test_problems_are_in_the_order_of_the_lines() -> None:
    text = GOOD.replace("rig: front", "rig: 5").replace("150 m", "far").replace("60 km/h", "6")
    assert [line.split(": ")[0] for line in problems(text)] == ["1:6", "2:8", "5:30"]


def test_member_of_the_right_type_is_blamed() -> None:
    assert changed("[two, three]", "[two]") == [
        "7:15: faults.1: the list has 1 of at least 2 items."
    ]
    (line,) = changed("[one,", "[Bad-One,")
    assert line.startswith("7:10: faults.0: must be lower case letters")


def test_scalar_that_fits_no_member_is_one_problem() -> None:
    (line,) = changed("rig: front", "rig: front\nlimit: high")
    assert line == "2:8: limit: must be a number ('high')."


def test_document_that_is_no_mapping_is_named_after_the_model() -> None:
    (line,) = problems("- 1")
    assert line.startswith("1:1: Rig: must be a mapping")


def test_control_characters_of_a_key_are_not_repeated() -> None:
    (line,) = changed("rig: front", 'rig: front\n"\\e[31m\\n": 1')
    assert line.startswith(r"2:1: '\x1b[31m\n': there is no key '\x1b[31m\n' here")


def test_long_value_is_cut() -> None:
    (line,) = changed("rig: front", f"rig: {'Q' * 5000}")
    assert len(line) < 300


@pytest.mark.slow
def test_many_problems_are_counted_and_the_first_listed() -> None:
    text = "\n".join(["rig: a", "speed: 1 m/s", *(f"k{k}: 1" for k in range(20_000))])
    document = parse_document(text, "f.yaml")
    begin = time.process_time()
    caught = refused(InputErrors, validate, document, Rig)
    assert time.process_time() - begin < 5.0
    assert len(caught.errors) == MAX_LISTED
    assert str(caught).endswith("\n20,000 errors, the first 100 are listed.")


def test_error_raised_for_one_problem_is_that_problem() -> None:
    with pytest.raises(SpecError) as caught:
        validate(parse_document(GOOD.replace("rig: front\n", ""), "f.yaml"), Rig)
    assert caught.value.remedy == "Add `rig:`."


# --- Errors of a record's validator keep the place that they are about ----------------------------


class Inner(BaseModel):
    """Refuses negative numbers, each at its place."""

    numbers: list[int]

    @model_validator(mode="after")
    def _positive(self) -> Self:
        found = [(("numbers", k), f"{{{n}}} is low") for k, n in enumerate(self.numbers) if n < 0]
        if found:
            raise misplaced(found)
        return self


class Outer(BaseModel):
    """Holds inner records."""

    inner: dict[str, Inner]


def test_places_are_below_the_place_of_the_record() -> None:
    with pytest.raises(ValidationError) as caught:
        Outer.model_validate({"inner": {"a": {"numbers": [1, -2, -3]}, "b": {"numbers": [-4]}}})
    found = [(item["loc"], item["msg"]) for item in caught.value.errors()]
    assert found == [
        (("inner", "a", "numbers", 1), "{-2} is low"),
        (("inner", "a", "numbers", 2), "{-3} is low"),
        (("inner", "b", "numbers", 0), "{-4} is low"),
    ]


def test_what_is_right_is_not_refused() -> None:
    assert Outer.model_validate({"inner": {"a": {"numbers": [1]}}}).inner["a"].numbers == [1]


@pytest.mark.parametrize(
    ("names", "again"),
    [([], []), (["a"], []), (["a", "a", "a"], [1, 2]), (["a", "b", "b", "a"], [2, 3])],
)
def test_repeated_names_every_occurrence_but_the_first(names: list[str], again: list[int]) -> None:
    assert repeated(names) == again
