"""Errors: their text, their exit codes, and that they survive a process boundary."""

from __future__ import annotations

import pickle

import pytest

from adeye.errors import (
    AdeyeError,
    ChannelError,
    ExpressionError,
    InputError,
    InputErrors,
    IntegrityError,
    PlatformError,
    SourceLocation,
    SpecError,
    SweepError,
    UnitError,
    UsageError,
    suggest,
)

WHERE = SourceLocation("odd/motorway.yaml", 14, 9)


def test_message_has_class_place_fault_and_remedy() -> None:
    error = SweepError("160 km/h is above 130 km/h", where=WHERE, remedy="Narrow the range.")
    assert (
        str(error)
        == "SweepError: odd/motorway.yaml:14:9: 160 km/h is above 130 km/h. Narrow the range."
    )


def test_message_without_place_or_remedy_ends_with_one_full_stop() -> None:
    assert str(SpecError("there is no such file")) == "SpecError: there is no such file."
    assert str(SpecError("there is no such file.")) == "SpecError: there is no such file."


def test_question_keeps_its_mark() -> None:
    assert str(SpecError("is it a file?")) == "SpecError: is it a file?"


@pytest.mark.parametrize(
    "kind", [SpecError, SweepError, ExpressionError, UnitError, UsageError, InputErrors]
)
def test_input_error_ends_with_2(kind: type[InputError]) -> None:
    assert issubclass(kind, InputError)
    assert kind.exit_code == 2


@pytest.mark.parametrize(("kind", "code"), [(IntegrityError, 4), (PlatformError, 5)])
def test_exit_code_of_what_the_user_did_not_cause(kind: type[AdeyeError], code: int) -> None:
    assert kind.exit_code == code
    assert not issubclass(kind, InputError)


def test_channel_error_is_no_input_error() -> None:
    assert issubclass(ChannelError, AdeyeError)
    assert not issubclass(ChannelError, InputError)


def test_several_errors_are_listed_and_counted() -> None:
    errors = InputErrors([SpecError("one", where=WHERE), UnitError("two")])
    assert str(errors).splitlines() == [
        "SpecError: odd/motorway.yaml:14:9: one.",
        "UnitError: two.",
        "2 errors.",
    ]


def test_one_error_is_counted_in_the_singular() -> None:
    assert str(InputErrors([SpecError("one")])).endswith("\n1 error.")


def test_unlisted_errors_are_counted() -> None:
    text = str(InputErrors([SpecError("one")], unlisted=1_999))
    assert text.endswith("\n2,000 errors, the first 1 are listed.")


@pytest.mark.parametrize(
    "error",
    [
        SweepError("wrong", where=WHERE, remedy="Mend it."),
        SpecError("wrong"),
        InputErrors([SpecError("one", where=WHERE), UnitError("two")], unlisted=3),
        PlatformError("disk full"),
    ],
)
def test_error_survives_pickling(error: AdeyeError) -> None:
    copy = pickle.loads(pickle.dumps(error))  # noqa: S301 - our own bytes
    assert type(copy) is type(error)
    assert str(copy) == str(error)


def test_location_is_path_line_column() -> None:
    assert str(WHERE) == "odd/motorway.yaml:14:9"


def test_suggest_names_the_nearest_word() -> None:
    assert suggest("cut_inn", ["cut_in", "cut_out"]) == "Did you mean 'cut_in'?"


def test_suggest_lists_all_when_none_is_near() -> None:
    assert suggest("x", ["cut_in", "cut_out"]) == "Allowed: cut_in, cut_out."


def test_suggest_says_when_nothing_is_allowed() -> None:
    assert suggest("x", []) == "Nothing is allowed here."
