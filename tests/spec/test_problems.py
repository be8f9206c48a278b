"""Validation: every problem with its line, its value, what is allowed and the nearest word."""

from __future__ import annotations

import time
from typing import Annotated, Literal

import pytest
from pydantic import Field

from adeye.errors import InputError, InputErrors, SpecError
from adeye.spec.document import MAX_LISTED, parse_document, validate
from adeye.spec.quantity import Condition, Identifier, Length, Many, Record, Speed


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
    with pytest.raises(InputError) as caught:
        validate(parse_document(text, "f.yaml"), Rig)
    lines = str(caught.value).splitlines()
    if isinstance(caught.value, InputErrors):
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


def test_unknown_key_is_placed_at_the_key_with_what_is_allowed() -> None:
    assert changed("speed: 60 km/h", "speed: 60 km/h\nsensor: {}") == [
        "3:1: sensor: there is no key 'sensor' here. Did you mean 'sensors'? "
        "Allowed: rig, speed, design, when, sensors, faults, limit."
    ]


def test_unknown_key_far_from_all_lists_what_is_allowed() -> None:
    assert changed("speed: 60 km/h", "speed: 60 km/h\nxyzzy: 1") == [
        "3:1: xyzzy: there is no key 'xyzzy' here. "
        "Allowed: rig, speed, design, when, sensors, faults, limit."
    ]


def test_missing_key_is_placed_at_its_record() -> None:
    assert changed("rig: front\n", "") == ["1:1: rig is missing. Add `rig:`."]
    assert changed(", range: 80 m", "") == ["4:8: sensors.eye.range is missing. Add `range:`."]


def test_wrong_unit_names_value_and_units() -> None:
    assert changed("60 km/h", "60 m") == [
        "2:8: speed: '60 m' is not a speed. Write a speed like '60 km/h' (units: m/s, km/h, mm/h)."
    ]


def test_wrong_word_is_named_with_the_nearest() -> None:
    assert changed("rig: front", "rig: front\ndesign: full_factoral") == [
        "2:9: design: must be 'zip', 'list' or 'full_factorial' ('full_factoral'). "
        "Did you mean 'full_factorial'?"
    ]


def test_wrong_type_names_the_value() -> None:
    assert changed("rig: front", "rig: 5") == ["1:6: rig: must be text (5)."]


def test_formula_keeps_its_message() -> None:
    assert changed("rig: front", "rig: front\nwhen: 'time >='") == [
        "2:7: when: 'time >=', character 8: a number, a name or '(' is missing."
    ]


def test_wrong_key_of_a_mapping_is_placed_at_the_key() -> None:
    (line,) = changed("  eye:", "  Eye-1:")
    assert line.startswith("4:3: sensors.Eye-1: must be lower case letters")
    assert line.endswith("(key 'Eye-1').")


def test_problems_are_in_the_order_of_the_lines() -> None:
    text = GOOD.replace("rig: front", "rig: 5").replace("150 m", "far").replace("60 km/h", "6")
    assert [line.split(": ")[0] for line in problems(text)] == ["1:6", "2:8", "5:30"]


def test_typo_in_one_member_of_a_union_is_one_problem() -> None:
    assert changed("kind: radar, range", "kind: radar, gian: 2.0, range") == [
        "5:23: sensors.beam.gian: there is no key 'gian' here. Did you mean 'gain'? "
        "Allowed: kind, range, gain."
    ]


def test_misspelt_kind_of_a_union_is_one_problem() -> None:
    assert changed("kind: camera", "kind: camra") == [
        "4:15: sensors.eye.kind: 'camra' is not one of 'camera', 'radar'. Did you mean 'camera'?"
    ]


def test_missing_kind_of_a_union_is_one_problem() -> None:
    assert changed("kind: camera, ", "") == ["4:8: sensors.eye.kind is missing. Add `kind:`."]


def test_typo_in_a_plugin_is_not_blamed_on_its_kind() -> None:
    assert changed("options: {a: 1}", "option: {a: 1}, x: 1") == [
        "6:29: sensors.mine.option: there is no key 'option' here. Did you mean 'options'? "
        "Allowed: kind, options.",
        "6:45: sensors.mine.x: there is no key 'x' here. Allowed: kind, options.",
    ]


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
    with pytest.raises(InputErrors) as caught:
        validate(document, Rig)
    assert time.process_time() - begin < 5.0
    assert len(caught.value.errors) == MAX_LISTED
    assert str(caught.value).endswith("\n20,000 errors, the first 100 are listed.")


def test_error_raised_for_one_problem_is_that_problem() -> None:
    with pytest.raises(SpecError) as caught:
        validate(parse_document(GOOD.replace("rig: front\n", ""), "f.yaml"), Rig)
    assert caught.value.remedy == "Add `rig:`."
